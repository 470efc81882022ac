"""A plan being played: what to send for each sample, and when to stop.

Playback and guard together.
"""

from __future__ import annotations

from dataclasses import dataclass

from pendulum_bridge.excitation.guard import (
    Bounds,
    Stopped,
    StopReason,
    Watch,
    find_clock_set_back,
    find_missing_samples,
    note_request,
    watch_sample,
)
from pendulum_bridge.excitation.playback import Playback, answer_sample, is_over
from pendulum_bridge.safety.rig_state import RigState
from pendulum_twin.plans.excitation import Excitation


@dataclass(frozen=True)
class Performance:
    """Hold the state between two samples.

    playback: how far the plan has been played.
    watch: what the guard remembers.
    """

    playback: Playback = Playback()  # noqa: RUF009 (frozen)
    watch: Watch = Watch()  # noqa: RUF009 (frozen)


@dataclass(frozen=True)
class Move:
    """Hold the performance after a sample, and what to send for it.

    performance: the state for the next sample.
    command: PWM fraction; None for a sample that is not new, 0 at the end.
    done: whether the plan has been played to its end.
    stopped: why the plan was stopped before its end; None when it was not.
    """

    performance: Performance
    command: float | None
    done: bool = False
    stopped: Stopped | None = None


def perform(
    stamp_ns: int,
    state: RigState,
    applied: float,
    performance: Performance,
    plan: Excitation,
    bounds: Bounds,
) -> Move:
    """Return what to send for a sample.

    stamp_ns: ns; the sampling time.
    applied: PWM fraction; what the driver last reported as sent.
    """
    answer = answer_sample(stamp_ns, state.cart_m, state.cart_m_s, performance.playback, plan)
    if answer.command is None:
        stopped = find_clock_set_back((performance.playback.stamp_ns - stamp_ns) / 1e9)
        command = 0.0 if stopped else None
        return Move(Performance(answer.playback, performance.watch), command, stopped=stopped)
    playback = answer.playback
    watch, stopped = watch_sample(state, applied, playback.gap_s, performance.watch, bounds)
    stopped = (
        stopped
        or find_missing_samples(playback.gap_s, bounds)
        or _find_unmoved_cart(state, playback)
    )
    if stopped:
        return Move(Performance(playback, watch), 0.0, stopped=stopped)
    watch = note_request(answer.command, 1 / plan.rate_hz, watch)
    return Move(Performance(playback, watch), answer.command, done=is_over(playback, plan))


def _find_unmoved_cart(state: RigState, playback: Playback) -> Stopped | None:
    """Return that the first push did not move the cart, if so: nothing could be centred."""
    if playback.way != 0:
        return None
    return Stopped(
        StopReason.NOT_MOVED, f"it moved by {1e3 * (state.cart_m - playback.start_m):.2g} mm"
    )
