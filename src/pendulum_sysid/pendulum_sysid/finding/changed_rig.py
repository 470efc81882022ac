"""Ask whether the rig changed between its recordings.

A load that was put on, or a belt that was tightened, between two recordings is no physics that the
twin lacks: each recording by itself is explained, with other constants. Together they leave errors
that look like a wrong clock, like a drag at a place, or like nothing that has a name.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.finding.hypotheses import list_possible_effects
from pendulum_sysid.finding.replication import group_recordings, widen_intervals
from pendulum_sysid.finding.search import Answer
from pendulum_sysid.finding.whole_windows import measure_fitted_starts
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.fit import HORIZONS, fit, fit_over_horizon
from pendulum_sysid.fitting.parameters import list_free_parameters
from pendulum_sysid.fitting.split import PATTERN
from pendulum_sysid.records import Estimate, Fit, Split
from pendulum_twin.arrays import Ints
from pendulum_twin.parameter_vector import SLOTS


@dataclass(frozen=True)
class SizeByPart:
    """Hold a parameter as each part of the recordings has it.

    name: "key" of a constant or "effect.parameter".
    unit: of the values.
    typical: magnitude of the value, or its typical size where the value is smaller.
    estimates: of each part, in order of time.
    """

    name: str
    unit: str
    typical: float
    estimates: tuple[Estimate, ...]

    @property
    def known(self) -> list[Estimate]:
        """Return the estimates of the parts that fix the parameter."""
        return [estimate for estimate in self.estimates if estimate.identifiable]

    @property
    def is_changed(self) -> bool:
        """Return whether two parts surely differ: many sizes are compared at once."""
        values = np.array([e.value for e in self.known])
        halves = np.array([0.5 * (e.high - e.low) for e in self.known])
        deviations = np.hypot(halves[:, None], halves) / decisions.INTERVAL_DEVIATIONS
        apart = abs(values[:, None] - values)
        return bool(np.any(apart > decisions.SURE_STANDARD_ERRORS * deviations))

    @property
    def difference(self) -> float:
        """Return the largest difference of two parts, as a share of the typical size."""
        return float(np.ptp([e.value for e in self.known]) / self.typical)


@dataclass(frozen=True)
class ChangedRig:
    """Hold how a rig changed between its recordings.

    parts: the recordings of each part, numbered from 1 in the order in which they were given.
    effects: with which each part is fitted by itself.
    misfit: of the parts by themselves, in units of noise.
    together: misfit of the fit to all recordings, in units of noise.
    sizes: of all parameters, rig and effects.
    """

    parts: tuple[range, ...]
    effects: tuple[str, ...]
    misfit: float
    together: float
    sizes: tuple[SizeByPart, ...]

    @property
    def changed(self) -> list[SizeByPart]:
        """Return what surely differs, the largest difference first."""
        changed = [size for size in self.sizes if size.is_changed]
        return sorted(changed, key=lambda size: size.difference, reverse=True)


def find_change(case: Case, split: Split, base: Fit, best: Fit) -> ChangedRig | None:
    """Return how the rig changed between its recordings; None where nothing says that it did.

    Where errors above the noise remain, each part of the recordings is fitted by itself, with the
    constants alone, with all effects, and with what is set anew at each start beside either. The
    rig changed if every part by itself ends at the noise, and a parameter surely differs. Where
    the pieces of windows, over which the fits go, hide all errors in the noise, as those of a
    pole's friction, whole windows are asked in their place.

    base, best: the fits to all recordings, with the constants alone and with all effects.
    """
    parts = group_recordings(case, split)
    enough = len(parts) > 1 and min(len(part) for part in parts) >= len(PATTERN)
    if not enough:
        return None
    is_hidden = best.choose <= decisions.MISFIT_AT_NOISE
    left = measure_fitted_starts(case, split.learn, best) if is_hidden else best.choose
    if left <= decisions.MISFIT_AT_NOISE:
        return None
    for together in (base, best, *_add_what_is_set_at_start(case, (base, best))):
        pieces = HORIZONS[-1] if is_hidden else together.pieces
        fits = [_fit_part(case, split, together, part, pieces) for part in parts]
        misfit = max(own.choose for own in fits)
        if misfit <= decisions.MISFIT_AT_NOISE:
            sizes = _list_sizes(case, together, fits)
            numbers = _number_recordings(case, len(parts))
            change = ChangedRig(numbers, together.effects, misfit, left, sizes)
            return change if change.changed else None
    return None


def _add_what_is_set_at_start(case: Case, fits: Sequence[Fit]) -> list[Fit]:
    """Return beginnings of fits with the effects that each start of the rig sets anew, too."""
    possible = list_possible_effects(case.twin.rig)
    longer = []
    for known in fits:
        more = [e for e in possible if e.set_at_start and e.name not in known.effects]
        theta = known.theta.copy()
        for effect in more:
            theta[SLOTS[effect.name]] = [parameter.probes[0] for parameter in effect.parameters]
        if more:
            effects = (*known.effects, *(effect.name for effect in more))
            longer.append(replace(known, effects=effects, theta=theta))
    return longer


def take_changed_rig(answer: Answer, change: ChangedRig) -> Answer:
    """Return the answer without the names that the parts by themselves do without.

    The interval of every size that changed holds those of all parts.
    """
    if not set(answer.best.effects) <= set(change.effects):
        named = tuple(effect for effect in answer.named if effect.effect in change.effects)
        answer = replace(answer, best=answer.base, named=named, perhaps=(), ties=())
    estimates = dict(answer.best.estimates)
    for size in [size for size in change.changed if size.name in estimates]:
        every = (estimates[size.name], *size.known)
        low, high = min(e.low for e in every), max(e.high for e in every)
        estimates[size.name] = replace(every[0], low=low, high=high)
    return replace(answer, best=replace(answer.best, estimates=estimates))


def _fit_part(case: Case, split: Split, together: Fit, part: Ints, pieces: int) -> Fit:
    """Return the fit to the learning windows of a part alone, its intervals as widened as any."""
    windows = split.learn
    own = Split(windows.pick(part), windows.pick(part[:0]), split.held_out)
    alone = fit(case, own, together.effects, together.theta, together.pieces)
    if pieces != together.pieces:
        alone = fit_over_horizon(case, own, alone, pieces)
    return widen_intervals(case, own, alone)


def _number_recordings(case: Case, parts: int) -> tuple[range, ...]:
    """Return the numbers of the recordings of each part."""
    signals = case.signals
    assert signals.after_s is not None
    count = len(np.unique(np.round(np.array(signals.after_s) / signals.period_s)))
    groups = np.array_split(np.arange(1, count + 1), parts)
    return tuple(range(int(group[0]), int(group[-1]) + 1) for group in groups)


def _list_sizes(case: Case, together: Fit, fits: Sequence[Fit]) -> tuple[SizeByPart, ...]:
    return tuple(
        SizeByPart(
            free.name,
            free.unit,
            max(free.size, abs(free.get(together.theta))),
            tuple(own.estimates[free.name] for own in fits),
        )
        for free in list_free_parameters(case.twin, together.effects, case.scales)
    )
