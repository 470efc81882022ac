"""Ask the parameters of a fit again in parts of the data: do effects and sizes replicate?

A part (a recording, or a third of a single one) has an estimate of its own: a Gauss-Newton step
from the fit to all windows, with the windows of the part alone. The estimate says whether an
effect is there again. Intervals hold the spread over blocks of time. Noise averages out over
blocks; physics that the model leaves out does not, and draws the estimates of the whole recording
its own way in each block. A constant of the rig is asked twice: in the fit, and beside drags of
other shapes (nuisance parameters), whose share the constant may have taken.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.special import stdtrit

from pendulum_sysid import decisions
from pendulum_sysid.finding.intervals import widen_estimate
from pendulum_sysid.fitting.block_spread import (
    compute_spreads,
    divide_windows,
    list_pieces,
    take_to_optimum,
)
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.gauss_newton import (
    Solution,
    compute_half_widths,
)
from pendulum_sysid.fitting.instants import widen_by_errors
from pendulum_sysid.fitting.linearised import System, linearise
from pendulum_sysid.fitting.parameters import (
    Free,
    list_effect_parameters,
    list_free_parameters,
    list_rig_parameters,
)
from pendulum_sysid.fitting.windows import shorten_windows
from pendulum_sysid.records import Estimate, Fit, Split
from pendulum_twin.arrays import Floats, Ints
from pendulum_twin.effects import BY_NAME, CATALOGUE
from pendulum_twin.effects.effect import Parameter, Scale


def _is_of_drag(parameter: Parameter) -> bool:
    return parameter.holds or parameter.per in (Scale.CART_SPEED, Scale.POLE_RATE)


DRAGS = tuple(  # the same at any place and time, in shapes of the speed
    effect.name
    for effect in CATALOGUE
    if effect.searched
    and any(_is_of_drag(p) for p in effect.parameters)
    and not any(p.shape for p in effect.parameters)
)


class Range(NamedTuple):
    """Hold the ends of a range of values, in the parameter's unit."""

    low: float
    high: float


@dataclass(frozen=True)
class BlockEstimates:
    """Hold a parameter as each block of time has it.

    values: (blocks,) estimates, in the parameter's unit.
    deviations: (blocks,) their standard deviations; infinite where a block does not fix the value.
    """

    values: Floats
    deviations: Floats


@dataclass(frozen=True)
class Replication:
    """Hold in how many parts of the recordings an effect is there again.

    shown: parts that show its size.
    possible: parts that could show its size.
    """

    shown: int
    possible: int

    @property
    def is_lasting(self) -> bool:
        """Return whether most parts that could show the effect show it, or no part could."""
        return self.shown > decisions.REPLICATED_SHARE * self.possible or not self.possible

    def __str__(self) -> str:
        return f"{self.shown} of {self.possible}"


@dataclass(frozen=True)
class RecordingGroup:
    """Hold recordings in a row.

    numbers: of the recordings, from 1, in the order in which they were given.
    windows: (k,) their learning windows, as rows of the split's.
    """

    numbers: range
    windows: Ints


def replicate_effects(case: Case, split: Split, fit: Fit) -> dict[str, Replication]:
    """Return for each effect with a size how often it is found again in parts of the windows.

    A part can show an effect whose size, as all windows have it, lies outside of the part's own
    interval about nothing. It shows the effect where its own size lies outside, too, on the same
    side. Effects of one recording happen once, and are not asked.
    """
    free = list_free_parameters(case.twin, fit.effects, case.scales)
    system = _linearise(case, split, fit, free)
    parts = estimate_parts(system, fit, free, divide_recordings(case, split, fit))
    replications = {}
    for name in [e for e in fit.effects if not BY_NAME[e].of_recording]:
        sizes = [
            (
                p.neutral if p.idle_beyond is None else case.scales[p.idle_beyond],
                fit.estimates[f"{name}.{p.name}"].value,
                parts[f"{name}.{p.name}"],
            )
            for p in BY_NAME[name].parameters
            if (not p.shape or p.idle_beyond is not None) and f"{name}.{p.name}" in parts
        ]
        if sizes:
            counts = [_count_shown(*size) for size in sizes]
            replications[name] = max(counts, key=lambda count: (count.possible, count.shown))
    return replications


def divide_recordings(case: Case, split: Split, fit: Fit) -> list[Ints]:
    """Return the parts in which effects are asked for again, as rows of the fit's windows.

    Each recording is a part, for what its own day or plan brings cannot be found again in another.
    A single recording is thirds of its time.
    """
    wholes = [group.windows for group in group_recordings(case, split)]
    if len(wholes) == 1:
        wholes = np.array_split(wholes[0], min(decisions.REPLICATION_PARTS, len(wholes[0])))
    return [list_pieces(whole, fit.pieces) for whole in wholes]


def group_recordings(case: Case, split: Split) -> list[RecordingGroup]:
    """Return each recording with its learning windows, or thirds of many recordings.

    A recording without learning windows is in no group, and counts among the numbers.
    """
    signals = case.signals
    if signals.after_s is None:
        return [RecordingGroup(range(1, 2), np.arange(len(split.learn)))]
    begins = np.round(np.array(signals.after_s) / signals.period_s)
    number = 1 + np.unique(begins, return_inverse=True)[1]
    stretch = np.searchsorted(signals.stretch_begins, split.learn.begin, side="right") - 1
    of_window = number[stretch]
    recordings = np.unique(of_window)
    groups = np.array_split(recordings, min(len(recordings), decisions.REPLICATION_PARTS))
    return [
        RecordingGroup(
            range(int(group[0]), int(group[-1]) + 1), np.flatnonzero(np.isin(of_window, group))
        )
        for group in groups
    ]


def _count_shown(neutral: float, value: float, parts: BlockEstimates) -> Replication:
    reach = decisions.INTERVAL_DEVIATIONS * parts.deviations
    could = abs(value - neutral) > reach
    does = np.sign(value - neutral) * (parts.values - neutral) > reach
    return Replication(int(np.sum(could & does)), int(np.sum(could)))


def widen_intervals(case: Case, split: Split, fit: Fit) -> Fit:
    """Return a fit with intervals that hold the spread of its sizes over blocks of time.

    Those of the rig's constants hold, too, what the recordings make of the constants beside drags
    of other shapes. A fit at the noise stays as it is: there blocks differ by noise alone, which
    the intervals hold already.
    """
    free = list_free_parameters(case.twin, fit.effects, case.scales)
    if fit.choose <= decisions.MISFIT_AT_NOISE or not free:
        return fit
    every = (*free, *_list_other_drags(case, fit))
    system = _linearise(case, split, fit, every)
    spreads = compute_spreads(system.pick(range(len(free))), fit, free)
    known = widen_by_errors(case, split, fit)
    widened = {
        p.name: _widen(known[p.name], p, spread) for p, spread in zip(free, spreads, strict=True)
    }
    for constant, beside in _estimate_beside_drags(case, system, fit, every).items():
        widened[constant.name] = _hold_both(widened[constant.name], constant, beside)
    return replace(fit, estimates={**known, **widened})


def _list_other_drags(case: Case, fit: Fit) -> tuple[Free, ...]:
    """Return the sizes of the drags of any place and time that the fit lacks."""
    return tuple(
        free
        for name in DRAGS
        if name not in fit.effects
        for free in list_effect_parameters(BY_NAME[name], case.scales)
    )


def _estimate_beside_drags(
    case: Case, system: System, fit: Fit, every: tuple[Free, ...]
) -> dict[Free, Range]:
    """Return the ranges of the rig's constants in which drags of other shapes have any size.

    As a rule the model leaves out a drag, too, and a viscous constant takes the share of the drag
    that grows with speed. Blocks of time show how large this share can be, once the shape of the
    drag is free. A constant that nothing fixes then has no range.

    system: the normal equations of all parameters, `every`.
    """
    step, deviations = _estimate(system, fit, every)
    spreads = compute_spreads(system, fit, every)
    halves = decisions.INTERVAL_DEVIATIONS * np.hypot(deviations, spreads)
    ranges = {}
    for k, constant in enumerate(list_rig_parameters(case.twin)):
        value = constant.get(fit.theta) + step[k] * constant.size
        half = float(halves[k])
        if np.isfinite(half):
            ranges[constant] = Range(value - half, value + half)
    return ranges


def _hold_both(estimate: Estimate, free: Free, other: Range) -> Estimate:
    below = estimate.value - min(estimate.low, other.low)
    above = max(estimate.high, other.high) - estimate.value
    return widen_estimate(estimate, free, below, above)


def _widen(estimate: Estimate, free: Free, spread: float) -> Estimate:
    more = decisions.INTERVAL_DEVIATIONS * spread
    below, above = estimate.value - estimate.low, estimate.high - estimate.value
    return widen_estimate(estimate, free, np.hypot(below, more), np.hypot(above, more))


def _linearise(case: Case, split: Split, fit: Fit, free: tuple[Free, ...]) -> System:
    """Return the normal equations of a fit's free runs."""
    problem = case.problem(shorten_windows(case.state, split.learn, fit.pieces))
    return linearise(problem, fit.theta, fit.start_states, free, fit.power)


def estimate_blocks(
    system: System, fit: Fit, free: tuple[Free, ...], blocks: int
) -> dict[str, BlockEstimates]:
    """Return every free parameter of a fit as each block of time has it.

    system: the normal equations of the fit, a row for each piece of a window.
    blocks: number of blocks, contiguous in time and of the same number of windows.
    """
    return estimate_parts(system, fit, free, divide_windows(system, fit.pieces, blocks))


def estimate_parts(
    system: System, fit: Fit, free: tuple[Free, ...], parts: Sequence[Ints]
) -> dict[str, BlockEstimates]:
    """Return every free parameter of a fit as each part of the windows has it.

    parts: rows of the system.
    """
    steps, deviations = zip(*(estimate_part(system, p, fit, free) for p in parts), strict=True)
    return {
        parameter.name: BlockEstimates(
            np.array([parameter.get(fit.theta) + step[k] * parameter.size for step in steps]),
            np.array([deviation[k] for deviation in deviations]),
        )
        for k, parameter in enumerate(free)
    }


def estimate_part(
    system: System, part: Ints, fit: Fit, free: tuple[Free, ...]
) -> tuple[Floats, Floats]:
    """Return the step of a part of the windows alone, in sizes, and its standard deviations.

    part: of the windows, whole windows in their pieces, as indices into the system.

    What is believed of the rig's constants counts in each part, too: nothing else fixes the mass,
    and no part could show a force where the mass is open.
    """
    own = replace(system, normals=system.normals[part], scores=system.scores[part])
    return _estimate(own, fit, free)


def _estimate(system: System, fit: Fit, free: tuple[Free, ...]) -> tuple[Floats, Floats]:
    """Return the Gauss-Newton step, in sizes, and its standard deviation, in the unit."""
    step = np.linalg.lstsq(system.normal, system.gradient, rcond=1e-10)[0]
    windows = len(system.normals) // fit.pieces
    if windows < 2:
        return step, np.full(len(free), np.inf)
    moved = take_to_optimum(system)
    solution = Solution(fit.theta, fit.start_states, np.empty(0), np.empty(0), True, moved)
    halves = compute_half_widths(solution, free, fit.pieces)
    return step, halves / stdtrit(max(windows - 1, 1), 0.975)
