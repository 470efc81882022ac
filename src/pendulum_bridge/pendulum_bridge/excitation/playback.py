"""Play a plan in answer to samples: command k belongs to sample k, even when samples are lost.

Samples are counted by their stamps, not by their number: a lost sample takes its command along, so
that the plan stays on the rig's clock. The period is followed slowly, as the rig's clock and the
clock of the stamps differ a little. Samples out of order get no command.
"""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

from pendulum_twin.plans.excitation import Excitation, compute_command, find_command_direction

# share of a stamp's deviation that the clock follows: averages jitter over 20 samples
STAMP_FOLLOWING_SHARE = 0.05
SAMPLES_A_LOOK = 25  # samples that show the rate
SAMPLES_QUEUED = 20  # most samples that may wait in the queues of their sender and their reader
STEADY_LOOKS = 4  # measurements in a row that agree; a wrong rate is refused then
MOST_LOOKS = 120  # measurements, after which a rate that does not settle is refused
RATE_TOLERANCE = 0.03


@dataclass(frozen=True)
class Playback:
    """Hold how far a plan has been played.

    sample: the number of the sample answered last, -1 before the first.
    stamp_ns: ns; its stamp.
    due_ns: ns; its stamp without jitter.
    start_m: m; where the cart would be without the plan's first push, until `way` is known.
    coasting_m_s: m/s; the cart's velocity when that push began to act.
    way: see `find_command_direction`; None before the push has shown it.
    gap_s: s, since the sample before.
    lost: samples that never came.
    old: samples dropped because their stamps were not new.
    """

    sample: int = -1
    stamp_ns: int = 0
    due_ns: float = 0.0
    start_m: float = 0.0
    coasting_m_s: float = 0.0
    way: int | None = None
    gap_s: float = 0.0
    lost: int = 0
    old: int = 0


@dataclass(frozen=True)
class PlaybackStep:
    """Hold the playback after a sample and the command for it.

    playback: the state for the next sample.
    command: PWM fraction; None for a sample without an answer.
    """

    playback: Playback
    command: float | None


def is_over(playback: Playback, plan: Excitation) -> bool:
    """Tell whether a sample after the plan's last sample has come."""
    return playback.sample >= len(plan.commands)


def answer_sample(
    stamp_ns: int, cart_m: float, cart_m_s: float, playback: Playback, plan: Excitation
) -> PlaybackStep:
    """Return the command for the sample with this stamp; 0 after the plan.

    The command acts until the next sample. A sample no newer than the sample before gets no
    command.
    Two samples in the same period, as stamps are uneven, get the same command of the plan.
    """
    if playback.sample >= 0 and stamp_ns <= playback.stamp_ns:
        return PlaybackStep(replace(playback, old=playback.old + 1), None)
    playback = _count_sample(stamp_ns, playback, plan)
    if is_over(playback, plan):
        return PlaybackStep(playback, 0.0)
    if playback.way is None and plan.push_ends is not None:
        playback = _follow_push(cart_m, cart_m_s, playback, plan)
    return PlaybackStep(
        playback, compute_command(plan, playback.sample, cart_m, cart_m_s, playback.way or 0)
    )


def _follow_push(cart_m: float, cart_m_s: float, playback: Playback, plan: Excitation) -> Playback:
    """Return the playback with where the cart would be without the push, and its way when known.

    A cart that moves already coasts on: it rolls on a tilted rail, or an uneven push has left it
    moving.
    """
    if not plan.commands[: playback.sample].any():
        playback = replace(playback, start_m=cart_m, coasting_m_s=cart_m_s)
    else:
        coasted_m = playback.coasting_m_s * playback.gap_s
        playback = replace(playback, start_m=playback.start_m + coasted_m)
    if plan.push_ends is not None and playback.sample >= plan.push_ends:
        way = find_command_direction(cart_m - playback.start_m)
        playback = replace(playback, way=way)
    return playback


def _count_sample(stamp_ns: int, playback: Playback, plan: Excitation) -> Playback:
    """Return the playback with the sample's number."""
    if playback.sample < 0:
        return replace(playback, sample=0, stamp_ns=stamp_ns, due_ns=float(stamp_ns))
    period_ns = 1e9 / plan.rate_hz
    ahead = max(round((stamp_ns - playback.due_ns) / period_ns), 0)
    due_ns = playback.due_ns + ahead * period_ns
    return replace(
        playback,
        sample=playback.sample + ahead,
        stamp_ns=stamp_ns,
        due_ns=due_ns + STAMP_FOLLOWING_SHARE * (stamp_ns - due_ns),
        gap_s=(stamp_ns - playback.stamp_ns) / 1e9,
        lost=playback.lost + max(ahead - 1, 0),
    )


def measure_rate(stamps_ns: Sequence[int], rate_hz: float) -> float:
    """Return the rate of samples, Hz, nearest to rate_hz: by the mean or by the median distance.

    The mean bears stamps that come in bursts, the median lost samples. Returns 0 for stamps that
    do not advance.
    """
    gaps = [after - before for before, after in pairwise(stamps_ns)]
    seen = [1e9 / gap for gap in (sum(gaps) / len(gaps), statistics.median(gaps)) if gap > 0]
    return min(seen, key=lambda hz: abs(hz - rate_hz), default=0.0)


def is_rate_fitting(seen_hz: float, rate_hz: float) -> bool:
    """Tell whether samples come at the rate of the plan."""
    return abs(seen_hz - rate_hz) <= RATE_TOLERANCE * rate_hz


def is_rate_steady(looks_hz: Sequence[float]) -> bool:
    """Tell whether the last measurements of the rate, Hz, agree with each other.

    Those of a wrong rate do. Those of a busy computer do not, and get time to settle.
    """
    last = looks_hz[-STEADY_LOOKS:]
    return len(last) == STEADY_LOOKS and all(is_rate_fitting(hz, last[0]) for hz in last)
