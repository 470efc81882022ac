"""A plan being played: what to send for each sample, and when to stop. Playback and guard put together."""

from __future__ import annotations

from dataclasses import dataclass

from pendulum_bridge.excitation.guard import (
    Bounds,
    Stopped,
    StopReason,
    Watch,
    asking,
    missing,
    watched,
)
from pendulum_bridge.excitation.playback import Playback, answered, over
from pendulum_bridge.safety.rig_state import RigState
from pendulum_twin.plans.excitation import Excitation


@dataclass(frozen=True)
class Performance:
    """Hold all that is remembered from sample to sample."""

    playback: Playback = Playback()  # noqa: RUF009 (frozen)
    watch: Watch = Watch()  # noqa: RUF009 (frozen)


@dataclass(frozen=True)
class Move:
    """Hold the performance after a sample, what to send for it, and how it ended.

    command: PWM fraction; None for a sample that gets none. done: the plan has been played to its
    end. stopped: why it was stopped before; None when it was not. In both cases the command is 0.
    """

    performance: Performance
    command: float | None
    done: bool = False
    stopped: Stopped | None = None


def performed(
    stamp_ns: int,
    state: RigState,
    applied: float,
    performance: Performance,
    plan: Excitation,
    bounds: Bounds,
) -> Move:
    """Return what to send for a sample. applied: PWM fraction, the last that the driver said it has sent."""
    answer = answered(stamp_ns, state.cart_m, state.cart_m_s, performance.playback, plan)
    if answer.command is None:
        return Move(Performance(answer.playback, performance.watch), None)
    playback = answer.playback
    watch, stopped = watched(state, applied, playback.gap_s, performance.watch, bounds)
    stopped = stopped or missing(playback.gap_s, bounds) or _not_moved(state, playback)
    if stopped:
        return Move(Performance(playback, watch), 0.0, stopped=stopped)
    watch = asking(answer.command, 1 / plan.rate_hz, watch)
    return Move(Performance(playback, watch), answer.command, done=over(playback, plan))


def _not_moved(state: RigState, playback: Playback) -> Stopped | None:
    """Return that the first push did not move the cart, if it did not: nothing could be centred."""
    if playback.way != 0:
        return None
    return Stopped(
        StopReason.NOT_MOVED, f"it moved by {1e3 * (state.cart_m - playback.start_m):.2g} mm"
    )
