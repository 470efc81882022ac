"""Ask whether the rig changed between its recordings.

A load that was put on, or a belt that was tightened, between two recordings is no physics that the
twin lacks: each recording by itself is explained, with other constants. Together they leave errors
that look like a wrong clock, like a drag at a place, or like nothing that has a name.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import takewhile

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.finding.hypotheses import (
    choose_typical,
    list_possible_effects,
    make_shapes,
)
from pendulum_sysid.finding.replication import group_recordings, widen_intervals
from pendulum_sysid.finding.search import Answer
from pendulum_sysid.finding.whole_windows import measure_fitted_starts
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.fit import HORIZONS, fit, fit_over_horizon
from pendulum_sysid.fitting.parameters import list_free_parameters
from pendulum_sysid.fitting.split import PATTERN
from pendulum_sysid.records import Estimate, Fit, Split
from pendulum_twin.arrays import Ints
from pendulum_twin.effects import BY_NAME
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


def find_change(case: Case, split: Split, answer: Answer) -> ChangedRig | None:
    """Return how the rig changed between its recordings; None where nothing says that it did.

    Where errors above the noise remain, each part of the recordings is fitted by itself, with one
    set of effects after another (`_list_beginnings`). The rig changed if every part by itself ends
    at the noise, and a parameter surely differs. Where the pieces of windows, over which the fits
    go, hide all errors in the noise, as those of a pole's friction, whole windows are asked in
    their place.

    answer: of the search of all recordings.
    """
    best = answer.best
    parts = group_recordings(case, split)
    enough = len(parts) > 1 and min(len(part.windows) for part in parts) >= len(PATTERN)
    if not enough:
        return None
    is_hidden = best.choose <= decisions.MISFIT_AT_NOISE
    left = measure_fitted_starts(case, split.learn, best) if is_hidden else best.choose
    if left <= decisions.MISFIT_AT_NOISE:
        return None
    for together in _list_beginnings(case, answer):
        pieces = HORIZONS[-1] if is_hidden else together.pieces
        every = (_fit_part(case, split, together, part.windows, pieces) for part in parts)
        fits = list(takewhile(lambda own: own.choose <= decisions.MISFIT_AT_NOISE, every))
        if len(fits) == len(parts):
            sizes = _list_sizes(case, together, fits)
            numbers, misfit = tuple(p.numbers for p in parts), max(f.choose for f in fits)
            change = ChangedRig(numbers, together.effects, misfit, left, sizes)
            return change if change.changed else None
    return None


def _list_beginnings(case: Case, answer: Answer) -> Iterator[Fit]:
    """Yield the fits from which parts of the recordings are fitted, the simplest first.

    They hold the constants alone, all effects of the best fit, and what each start of the rig sets
    anew beside either. The change leads the search of all recordings astray, so every effect that
    was tried alone is asked as well.
    """
    base, best = answer.base, answer.best
    anew = [e.name for e in list_possible_effects(case.twin.rig) if e.set_at_start]
    tried = [set_.effects for set_ in answer.sets]
    for known in (base, best):
        yield known
        yield _add_effects(case, known, anew)
    for effects in tried:
        added = [effect for effect in effects if effect not in base.effects]
        if len(added) == 1 and set(base.effects) <= set(effects):
            yield _add_effects(case, base, added)


def _add_effects(case: Case, known: Fit, names: Sequence[str]) -> Fit:
    """Return the beginning of a fit with further effects at their typical sizes."""
    more = [name for name in names if name not in known.effects]
    theta = known.theta.copy()
    for name in more:
        typical = choose_typical(make_shapes(known.theta, BY_NAME[name], case.scales))
        theta[SLOTS[name]] = typical.whole[SLOTS[name]]
    return replace(known, effects=(*known.effects, *more), theta=theta)


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
