"""Find steps that no motion makes: spikes, which return, and jumps, which stay.

A rig's velocity may change within a sample (a cart meets its end stop, a stuck cart breaks loose),
but each step then still lies between the steps before and the steps after. A step that lies
outside both did not happen on the rig. How far outside it may lie follows from the noise, the
encoder's step and how much the velocity changes nearby.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.clock import Rate
from pendulum_twin.arrays import Floats, Mask

Places = NDArray[np.int64]

PASSES = 4
NO_STEP = 1e-9  # m or rad: below it a step is rounding


@dataclass(frozen=True)
class Jumps:
    """Hold the spikes and jumps of a signal.

    good: (n,) False at spikes.
    stays: the samples after which the signal stays elsewhere.
    """

    good: Mask
    stays: Places


@dataclass(frozen=True)
class _Motion:
    """Hold what motion allows: all (n-1,), one entry a step, in the signal's unit per period."""

    periods: Floats  # how long each step lasts
    low: Floats
    high: Floats
    slack: Floats
    floor: float  # in the signal's unit

    def measure_excess(self, step: Floats, first: Places, last: Places) -> tuple[Floats, Floats]:
        """Return by how much steps exceed the motion (below it: negative), and the allowance.

        step: the signal's change from sample first to sample last + 1."""
        ends = np.concatenate([[0.0], np.cumsum(self.periods)])
        periods = ends[last + 1] - ends[first]
        low = np.minimum(self.low[first], self.low[last]) * periods
        high = np.maximum(self.high[first], self.high[last]) * periods
        excess = np.maximum(step - high, 0.0) - np.maximum(low - step, 0.0)
        return excess, self.floor + np.maximum(self.slack[first], self.slack[last]) * np.minimum(
            periods, 1.0
        )


def measure_least_step(values: Floats) -> float:
    """Return the least step out of line in a signal (n,) without noise, by encoder and range."""
    moved = np.abs(np.diff(values))
    moved = moved[moved > NO_STEP]
    quantum = float(np.quantile(moved, 0.01)) if len(moved) else 0.0
    low, high = np.quantile(values, [0.01, 0.99])
    return max(
        decisions.SPIKE_ENCODER_STEPS * quantum,
        decisions.SPIKE_RANGE_SHARE * float(high - low),
        NO_STEP,
    )


def measure_step_floor(values: Floats) -> float:
    """Return the least step out of line in a signal (n,), its noise included."""
    steps = np.diff(values)
    noise = 0.0
    if len(steps) > 2 * decisions.SPIKE_SIDE_STEPS:
        noise = 1.4826 * float(
            np.median(np.abs(steps - sum(_compute_sides(steps, np.median)) / 2))
        )
    return max(measure_least_step(values), decisions.SPIKE_DEVIATIONS * noise)


def take_shortest_way(steps: Floats, turn: float | None) -> Floats:
    """Return steps without whole turns; turn is None for a signal that does not come round."""
    return steps if turn is None else steps - np.rint(steps / turn) * turn


def find_jumps(stamps: Floats, values: Floats, rate: Rate, turn: float | None = None) -> Jumps:
    """Find the spikes and jumps of a signal (n,), all finite.

    A step over a gap too long to fill is not judged.

    turn: how much further the signal is at the same place again; None when never. Where spikes are
    many they hide one another, so what is left is looked through again.
    """
    left, stays = np.arange(len(values)), np.empty(0, dtype=np.int64)
    for _ in range(PASSES):
        steps = take_shortest_way(np.diff(values[left]), turn)
        spikes, stays = _search_once(
            stamps[left], np.cumsum(np.concatenate([values[:1], steps])), rate, turn
        )
        stays = left[stays]
        if not spikes:
            break
        left = np.delete(left, np.concatenate([np.arange(first, stop) for first, stop in spikes]))
    good = np.zeros(len(values), dtype=bool)
    good[left] = True
    return Jumps(good, stays)


def _search_once(
    stamps: Floats, values: Floats, rate: Rate, turn: float | None
) -> tuple[list[tuple[int, int]], Places]:
    spikes: list[tuple[int, int]] = []
    stays: list[int] = []
    if len(values) < 3 * decisions.SPIKE_SIDE_STEPS:
        return spikes, np.array(stays, dtype=np.int64)
    steps, every = np.diff(values), np.arange(len(values) - 1)
    motion = _bound_motion(steps, np.diff(stamps) / rate.period_s, measure_step_floor(values))
    off = steps - 0.5 * (motion.low + motion.high) * motion.periods
    excess, allowed = motion.measure_excess(steps, every, every)
    out = np.where(np.diff(stamps) < rate.break_s, _drop_slips(excess, turn) / allowed, 0.0)
    for step in np.flatnonzero(out > 1.0):
        if spikes and step < spikes[-1][1]:
            continue
        spike = _find_spike(values, motion, off, int(step), turn)
        returns = spike is not None and spike[0] > 0 and spike[1] < len(values)
        if spike and (returns or out[step] > decisions.JUMP_RATIO):
            spikes.append(spike)
        elif not spike and out[step] > decisions.JUMP_RATIO:
            stays.append(int(step))
    return spikes, np.array(stays, dtype=np.int64)


def _bound_motion(steps: Floats, periods: Floats, floor: float) -> _Motion:
    rates = steps / periods
    before, after = _compute_sides(rates, np.median)
    spread = np.maximum(*_compute_sides(rates, _compute_deviation))
    speed = np.maximum(np.abs(before), np.abs(after))
    slack = (
        np.abs(after - before)
        + decisions.SPIKE_SPREADS * spread
        + decisions.SPIKE_SPEED_SHARE * speed
    )
    slack[: decisions.SPIKE_SIDE_LEAST] += (
        2 * speed[: decisions.SPIKE_SIDE_LEAST]
    )  # where one side is not known, the signal may have turned round
    slack[-decisions.SPIKE_SIDE_LEAST :] += 2 * speed[-decisions.SPIKE_SIDE_LEAST :]
    return _Motion(periods, np.minimum(before, after), np.maximum(before, after), slack, floor)


def _drop_slips(excess: Floats, turn: float | None) -> Floats:
    """Return the magnitudes, 0 where a neighbouring step goes along: a slip is motion.

    A step that is a fair part of a turn is none, and may only seem to go along.
    """
    beside = np.concatenate([[0.0], excess, [0.0]])
    along = np.maximum(beside[:-2] * np.sign(excess), beside[2:] * np.sign(excess))
    slips = along * decisions.SPIKE_SHARED_EXCESS >= np.abs(excess)
    if turn is not None:
        slips &= np.abs(excess) < decisions.SPIKE_TURN_SHARE * turn
    return np.where(slips, 0.0, np.abs(excess))


def _find_spike(
    values: Floats, motion: _Motion, off: Floats, step: int, turn: float | None
) -> tuple[int, int] | None:
    """Return the fewest samples beside a step whose removal leaves a motion.

    None when the signal stays elsewhere.

    off: (n-1,) how far every step is from the middle of what motion does.
    """
    to_end = min(step + 1, len(values) - 1 - step)
    widths = range(1, min(decisions.SPIKE_LONGEST, to_end) + 1)
    sides = np.array(
        [side for w in widths for side in ((step + 1, step + 1 + w), (step + 1 - w, step + 1))]
    )
    before, after = sides[:, 0] - 1, sides[:, 1]
    inner = (before >= 0) & (after < len(values))
    sides, before, after = sides[inner], before[inner], after[inner]
    if len(sides):
        excess, allowed = motion.measure_excess(
            take_shortest_way(values[after] - values[before], turn), before, after - 1
        )
        back = -off * np.sign(off[step])
        if turn is not None:  # half a turn has no sign
            back = np.where(np.abs(off) >= decisions.SPIKE_TURN_SHARE * turn, np.abs(off), back)
        back[step] = 0.0
        most = np.array(
            [back[first:last].max() for first, last in zip(before, after, strict=True)]
        )
        misfit = np.where(
            most > decisions.SPIKE_RETURN_SHARE * abs(off[step]), np.abs(excess) / allowed, np.inf
        )
        if misfit.min() <= 1.0:
            first, stop = sides[int(np.argmax(misfit <= misfit.min() + decisions.SPIKE_AS_GOOD))]
            return int(first), int(stop)
    if to_end > decisions.SPIKE_LONGEST:
        return None
    return (0, step + 1) if step + 1 == to_end else (step + 1, len(values))


def _compute_sides(rates: Floats, statistic: Callable[..., Floats]) -> tuple[Floats, Floats]:
    """Return a statistic of the steps before and after every step.

    A side with too few steps takes the value of the other.
    """
    count = len(rates)
    windows = statistic(sliding_window_view(rates, decisions.SPIKE_SIDE_STEPS), axis=1)
    before, after = np.empty(count), np.empty(count)
    before[decisions.SPIKE_SIDE_STEPS :] = windows[: count - decisions.SPIKE_SIDE_STEPS]
    after[: count - decisions.SPIKE_SIDE_STEPS] = windows[1:]
    for k in range(decisions.SPIKE_SIDE_STEPS):
        before[k] = (
            statistic(rates[None, :k], axis=1)[0] if k >= decisions.SPIKE_SIDE_LEAST else after[k]
        )
        end = count - 1 - k
        after[end] = (
            statistic(rates[None, end + 1 :], axis=1)[0]
            if k >= decisions.SPIKE_SIDE_LEAST
            else before[end]
        )
    return before, after


def _compute_deviation(windows: Floats, axis: int) -> Floats:
    return np.median(np.abs(windows - np.median(windows, axis=axis, keepdims=True)), axis=axis)
