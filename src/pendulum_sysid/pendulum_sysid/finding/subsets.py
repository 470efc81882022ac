"""Find the sets of effects that together explain most: best subsets of the linearised cost.

Growth by one effect at a time cannot reach a set whose members help only together: dry friction
and a delay each hide behind the other. Linearised about a fit, the cost is a least-squares problem
with a column for each candidate, so that every set of a few candidates can be tried (best subset
selection; Miller, Subset Selection in Regression (2002), chapter 3). Sets are compared by
cross-validation over blocks of time, and of sets that do as well the smallest counts (the rule of
one standard error; Breiman et al., Classification and Regression Trees (1984), section 3.4.3).
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.finding.journal import Search
from pendulum_sysid.finding.propose import (
    find_largest_step,
    find_least_step,
    list_probes,
    move_along,
    put_effect,
)
from pendulum_sysid.fitting.linearised import System, linearise
from pendulum_sysid.fitting.parameters import Free, list_free_parameters
from pendulum_sysid.fitting.windows import shorten_windows
from pendulum_sysid.records import Fit
from pendulum_twin.arrays import Floats, Ints, Mask
from pendulum_twin.effects.effect import Effect

RIDGE = 1e-6  # of a column's own weight: keeps two columns that are alike solvable
SOLVED_AT_ONCE = 20_000  # sets; bounds the memory


@dataclass(frozen=True)
class Subset:
    """Hold a set of effects that lowers the linearised cost.

    effects: names, those of the fit first that no other effect of the set contains.
    theta: (SIZE,) parameter vector from which a fit of the set starts.
    gains: (blocks,) gain of the log likelihood in each block of time, by a fit to the others.
    """

    effects: tuple[str, ...]
    theta: Floats
    gains: Floats

    @property
    def gain(self) -> float:
        """Return the cross-validated gain over all blocks."""
        return float(self.gains.sum())


@dataclass(frozen=True)
class LinearisedCost:
    """Hold the linearised cost about a fit, with a column for each probe of a candidate.

    effects: (probes,) the candidate of each probe.
    targets: (probes, SIZE) parameter vectors of the probes.
    fitted: number of parameters that are fitted already; their columns come first.
    normals: (blocks, columns, columns) matrix of each block of time.
    scores: (blocks, columns) gradient of each block.
    beliefs, pulls: (columns,) as of `System`.
    """

    effects: tuple[Effect, ...]
    targets: Floats
    fitted: int
    normals: Floats
    scores: Floats
    beliefs: Floats
    pulls: Floats

    @cached_property
    def normal(self) -> Floats:
        """Return the matrix over all blocks, (columns, columns), beliefs included."""
        return self.normals.sum(axis=0) + np.diag(self.beliefs)

    @cached_property
    def gradient(self) -> Floats:
        """Return the gradient over all blocks, (columns,), beliefs included."""
        return self.scores.sum(axis=0) + self.beliefs * self.pulls


def find_subsets(search: Search, fit: Fit, most: int) -> list[Subset]:
    """Return the sets that are worth a fit: the smallest that do as well as any, the best first.

    most: effects that a set holds beyond those of the fit.
    fit: about which the cost is linearised; over a short horizon, on which runs depend nearly
        linearly on small effects.
    """
    free = list_free_parameters(search.case.twin, fit.effects, search.case.scales)
    columns = _linearise_candidates(search, fit, free)
    if not columns.effects:
        return []
    chosen: list[tuple[Ints, Floats, Floats]] = []
    kept: list[Ints] = [np.array([], dtype=np.int64)]
    for size in range(1, most + 1):
        sets = _list_sets(columns, kept, size)
        if not len(sets):
            break
        steps, gains = _solve_sets(columns, sets)
        order = np.argsort(-gains)
        order = order[gains[order] > 0.0]
        kept = [sets[k] for k in order[: decisions.SUBSETS_EXTENDED]]
        for k in _pick_distinct(columns, sets, order)[: decisions.SUBSETS_VALIDATED]:
            chosen.append((sets[k], steps[k], _cross_validate(columns, sets[k])))
    return [
        _make_subset(columns, fit, free, members, steps, gains)
        for members, steps, gains in _keep_smallest(columns, chosen)
    ]


def _linearise_candidates(search: Search, fit: Fit, free: tuple[Free, ...]) -> LinearisedCost:
    case = search.case
    probed = list_probes(case, fit)
    windows = shorten_windows(case.state, search.split.learn, fit.pieces)
    targets = np.array([theta for _, theta in probed]).reshape(-1, fit.theta.size)
    system = linearise(
        case.problem(windows), fit.theta, fit.start_states, free, fit.power, targets
    )
    effects = tuple(effect for effect, _ in probed)
    blocks = _cut_blocks(system)
    return LinearisedCost(
        effects,
        targets,
        len(free),
        np.array([system.normals[block].sum(axis=0) for block in blocks]),
        np.array([system.scores[block].sum(axis=0) for block in blocks]),
        np.broadcast_to(system.beliefs, len(free) + len(targets)),
        np.broadcast_to(system.pulls, len(free) + len(targets)),
    )


def _cut_blocks(system: System) -> list[Ints]:
    """Return the indices of the windows in each block of time."""
    count = len(system.normals)
    return np.array_split(np.arange(count), min(decisions.SPREAD_BLOCKS, count))


def _list_sets(columns: LinearisedCost, kept: Sequence[Ints], size: int) -> Ints:
    """Return sets of probes, (sets, size): all of them, or those that extend the best smaller.

    No set holds an effect twice, or an effect beside one that contains it.
    """
    count = len(columns.effects)
    if size <= decisions.SUBSETS_COMPLETE:
        sets = np.array(list(itertools.combinations(range(count), size)), dtype=np.int64)
    else:
        extended = {tuple(sorted((*members, k))) for members in kept for k in range(count)}
        sets = np.array(sorted(s for s in extended if len(set(s)) == size), dtype=np.int64)
    if not len(sets):
        return sets.reshape(0, size)
    apart = _tell_apart(columns.effects)
    fine = np.ones(len(sets), dtype=bool)
    for a, b in itertools.combinations(range(size), 2):
        fine &= apart[sets[:, a], sets[:, b]]
    return sets[fine]


def _tell_apart(effects: Sequence[Effect]) -> Mask:
    """Return which probes may stand side by side, (probes, probes)."""
    return np.array(
        [
            [
                a.name != b.name and a.name not in b.simpler and b.name not in a.simpler
                for b in effects
            ]
            for a in effects
        ]
    )


def _solve_sets(columns: LinearisedCost, sets: Ints) -> tuple[Floats, Floats]:
    """Return the steps along the probes of each set, (sets, size), and the gains, (sets,).

    Everything that is fitted already follows. A set that needs an impossible step gains nothing.
    A probe of shapes alone is no longer than it is: a step beyond its end stops there.
    """
    normal, gradient = columns.normal, columns.gradient
    n = columns.fitted
    fitted = normal[:n, :n] + RIDGE * np.diag(np.diag(normal)[:n])
    follow = np.linalg.lstsq(fitted, normal[:n, n:], rcond=1e-12)[0]
    own = normal[n:, n:] - normal[n:, :n] @ follow
    own[np.diag_indices_from(own)] *= 1.0 + RIDGE
    own[np.diag_indices_from(own)] += 1e-12
    slope = gradient[n:] - follow.T @ gradient[:n]
    least, most = (
        np.array([find(effect) for effect in columns.effects])
        for find in (find_least_step, find_largest_step)
    )
    has_sizes = np.array([bool(effect.sizes) for effect in columns.effects])
    steps = np.concatenate(
        [
            np.linalg.solve(own[part[:, :, None], part[:, None, :]], slope[part][..., None])[
                ..., 0
            ]
            for part in np.array_split(sets, max(len(sets) // SOLVED_AT_ONCE, 1))
        ]
    )
    gains = 0.5 * np.sum(slope[sets] * steps, axis=1)
    possible = (steps >= least[sets]) & ((steps <= most[sets]) | ~has_sizes[sets])
    stopped = np.where(has_sizes[sets], steps, np.minimum(steps, most[sets]))
    # the cost is lowest at the solution and grows with the square of the way from it
    for k in np.flatnonzero(np.any(stopped != steps, axis=1)):
        back = stopped[k] - steps[k]
        gains[k] -= 0.5 * back @ own[np.ix_(sets[k], sets[k])] @ back
    return stopped, np.where(possible.all(axis=1), gains, 0.0)


def _pick_distinct(columns: LinearisedCost, sets: Ints, order: Ints) -> list[int]:
    """Return the indices of the best set for each choice of effects, in order of their gains."""
    best: dict[tuple[str, ...], int] = {}
    for k in order:
        best.setdefault(tuple(columns.effects[p].name for p in sets[k]), int(k))
        if len(best) == decisions.SUBSETS_VALIDATED:
            break
    return list(best.values())


def _cross_validate(columns: LinearisedCost, members: Ints) -> Floats:
    """Return the gain in each block of a fit to the other blocks, (blocks,)."""
    at = np.concatenate([np.arange(columns.fitted), columns.fitted + members])
    normals, scores = columns.normals[:, at[:, None], at], columns.scores[:, at]
    whole_normal, whole_gradient = columns.normal[at[:, None], at], columns.gradient[at]
    gains = np.empty(len(normals))
    for b, (normal, score) in enumerate(zip(normals, scores, strict=True)):
        others = whole_normal - normal, whole_gradient - score
        step = np.linalg.lstsq(*others, rcond=1e-10)[0]
        gains[b] = step @ score - 0.5 * step @ normal @ step
    return gains


def _keep_smallest(
    columns: LinearisedCost, chosen: Sequence[tuple[Ints, Floats, Floats]]
) -> list[tuple[Ints, Floats, Floats]]:
    """Return the smallest sets that no larger set is ahead of by more than a standard error."""
    if not chosen:
        return []
    best = max(chosen, key=lambda entry: entry[2].sum())
    near = [entry for entry in chosen if _is_as_good(entry[2] - best[2])]
    size = min(_count_parameters(columns, entry[0]) for entry in near)
    least = min(len(entry[0]) for entry in near)
    kept = [
        entry
        for entry in near
        if len(entry[0]) == least or _count_parameters(columns, entry[0]) == size
    ]
    kept.sort(key=lambda entry: -entry[2].sum())
    return kept[: decisions.SUBSETS_REFITTED]


def _is_as_good(lead: Floats) -> bool:
    """Return whether a set is at most one standard error behind.

    lead: over the best set in each block, (blocks,).
    """
    spread = float(np.std(lead, ddof=1)) * np.sqrt(len(lead)) if len(lead) > 1 else np.inf
    return float(lead.sum()) >= -spread


def _count_parameters(columns: LinearisedCost, members: Ints) -> int:
    return sum(max(len(columns.effects[k].parameters), 1) for k in members)


def _make_subset(
    columns: LinearisedCost,
    fit: Fit,
    free: tuple[Free, ...],
    members: Ints,
    steps: Floats,
    gains: Floats,
) -> Subset:
    """Return the set with the parameter vector that the linearised cost is lowest at."""
    n = columns.fitted
    normal, gradient = columns.normal, columns.gradient
    wanted = gradient[:n] - normal[:n, n + members] @ steps
    follow = np.linalg.lstsq(normal[:n, :n], wanted, rcond=1e-12)[0]
    theta, effects = fit.theta.copy(), fit.effects
    for parameter, change in zip(free, follow, strict=True):
        value = parameter.get(fit.theta) + change * parameter.size
        parameter.put(theta, float(np.clip(value, parameter.low, parameter.high)))
    for k, step in zip(members, steps, strict=True):
        effect = columns.effects[k]
        move_along(theta, effect, columns.targets[k], float(step), fit.effects)
        effects = put_effect(effect, effects)
    return Subset(effects, theta, gains)
