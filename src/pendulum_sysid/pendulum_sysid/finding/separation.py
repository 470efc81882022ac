"""How far two hypotheses about a rig lie apart on given windows, before anything is fitted.

Each hypothesis is a column: the change that it makes of the free runs, in units of noise, when
every window's start state follows (`linearised.linearise`). The distance is what is left of a
column, in standard errors, when others and the rig's constants have taken what they can: the
square root of the noncentrality of the test between the two (Kay, Fundamentals of Statistical
Signal Processing II (1998), section 7.7; to first order in the sizes).
"""

from __future__ import annotations

import itertools
from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.finding.hypotheses import EffectShape
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.cross_validation import find_tame
from pendulum_sysid.fitting.linearised import linearise
from pendulum_sysid.fitting.parameters import Free
from pendulum_sysid.fitting.problem import Problem
from pendulum_sysid.fitting.windows import shorten_windows
from pendulum_sysid.records import Fit, Split, Windows
from pendulum_twin.arrays import Floats, Ints
from pendulum_twin.effects import BY_NAME, CATALOGUE
from pendulum_twin.effects.effect import Effect
from pendulum_twin.parameter_vector import SLOTS

NOTHING = 1e-6  # standard errors: what shows less does not show


@dataclass(frozen=True)
class ColumnProducts:
    """Hold the products of all columns with each other, start states following.

    Columns of free parameters come first, then those of shapes, then those of targets.

    normal: (columns, columns) the products.
    free: the parameters that the first columns change.
    shapes: of the columns after them.
    at: of each shape its first column; its sizes stand there, then its moves.
    first_target: the first column of the changes that are asked about.
    """

    normal: Floats
    free: tuple[Free, ...]
    shapes: tuple[EffectShape, ...]
    at: tuple[int, ...]
    first_target: int

    def list_columns(self, k: int) -> Ints:
        """Return the columns of shape k."""
        return self.at[k] + np.arange(len(self.shapes[k].alone) + len(self.shapes[k].moved))

    def get_target(self, k: int = 0) -> Floats:
        """Return target k as a combination of columns, (columns,)."""
        return np.eye(len(self.normal))[self.first_target + k]

    def is_visible(self, k: int) -> bool:
        """Return whether shape k changes anything that is measured."""
        return bool(np.any(np.diag(self.normal)[self.list_columns(k)] > NOTHING**2))


@dataclass(frozen=True)
class Tie:
    """Say what a recording cannot part from an effect that a fit holds.

    effect: its name.
    rival: the other effect; None for the rig's constants.
    distance: standard errors; what is left of the effect when the rival and the constants have
        taken what they can.
    theta: (SIZE,) of the twin with the rival in the effect's place, as near as it comes.
    by_no_motion: True where no recording of such a rig can part them.
    """

    effect: str
    rival: str | None
    distance: float
    theta: Floats
    by_no_motion: bool = False


@dataclass(frozen=True)
class Rest:
    """Hold what is left of a column when others have taken what they can.

    distance: standard errors.
    columns: (k,) indices of the others.
    coefficients: (k,) with which each takes its part.
    """

    distance: float
    columns: Ints
    coefficients: Floats


def pose_on_deciding_windows(case: Case, split: Split, fit: Fit) -> tuple[Problem, Floats]:
    """Return the problem of some of the training and choosing windows, and the errors there.

    The errors are those of `Fit.power`, divided by how many windows each of these stands for. The
    windows are cut into as many pieces as those of the fit.
    """
    begin = np.sort(np.concatenate([split.train.begin, split.choose.begin]))
    kept = spread_indices(len(begin))
    chosen = Windows(begin[kept], split.train.samples, case.state.states[begin[kept]])
    windows = shorten_windows(case.state, chosen, fit.pieces)
    return case.problem(windows), fit.power / (len(begin) / len(kept))


def spread_indices(count: int, most: int | None = None) -> Ints:
    """Return the indices of at most so many windows, spread evenly over all of them."""
    most = most or decisions.WINDOWS_COMPARED
    return np.unique(np.linspace(0, count - 1, most).round().astype(np.int64))


def compute_naming_threshold(values: int) -> float:
    """Return how many standard errors a diagnosis needs to name an effect.

    A third of the values is for choosing. Over d standard errors, the right twin is ahead by d/2
    there in the mean, and by the factor of misfit exp(d^2 / 4 values), for the heavy-tailed
    likelihood counts half (`judge.compute_lead`).

    values: how many a diagnosis decides on.
    """
    return max(
        decisions.SURE_STANDARD_ERRORS,
        2 * decisions.LEAD_STANDARD_ERRORS * np.sqrt(3.0),
        np.sqrt(4 * values * np.log(decisions.LEAD_MISFIT_RATIO)),
    )


def find_stand_in(effect: Effect, free: Collection[Free]) -> str | None:
    """Return the name of the effect that stands for this effect; None where motion shows it.

    Twins that move alike may differ in constants, too. A constant that is held, or of which
    something is believed beforehand, separates them.

    free: parameters of the fit, those of the rig's constants among them.
    """
    open_names = {parameter.name for parameter in free if np.isinf(parameter.spread)}
    return effect.shows_as if open_names.issuperset(effect.shows_as_with) else None


def list_doubles(effect: Effect, free: Collection[Free]) -> tuple[Effect, ...]:
    """Return the effects that look the same in every motion of a rig with these free constants."""
    own = find_stand_in(effect, free)
    searched = (other for other in CATALOGUE if other.searched)
    return tuple(e for e in searched if e.name == own or find_stand_in(e, free) == effect.name)


def is_related(effect: str, other: str) -> bool:
    """Return whether an effect is another, contains it or becomes it at an end of its range."""
    return effect == other or other in BY_NAME[effect].simpler or other in BY_NAME[effect].becomes


def is_rival(other: Effect, effect: Effect, free: Collection[Free]) -> bool:
    """Return whether another effect could be mistaken for this effect.

    The effect itself, effects that contain it or become it at an end of their range, and its
    doubles could not.

    free: parameters of the fit, those of the rig's constants among them.
    """
    stand_in = find_stand_in(effect, free)
    double = find_stand_in(other, free) is not None or other.name == stand_in
    return not is_related(other.name, effect.name) and not double


def compute_columns(
    problem: Problem,
    theta: Floats,
    free: tuple[Free, ...],
    power: Floats,
    shapes: tuple[EffectShape, ...] = (),
    targets: Floats | None = None,
) -> ColumnProducts:
    """Return the columns of free parameters, of shapes, and of the changes to targets.

    theta: (SIZE,) from which everything changes.
    power: (channels,) mean squared errors that count as noise.
    targets: (targets, SIZE).
    """
    targets = np.empty((0, theta.size)) if targets is None else targets
    steps = [
        row
        for shape in shapes
        for row in (*shape.alone, *shape.moved, *([shape.whole] if len(shape.moved) else []))
    ]
    ends = np.concatenate([np.array(steps).reshape(-1, theta.size), targets])
    problem = drop_wild_windows(problem, theta, power)
    normal = linearise(
        problem, theta, problem.windows.start_states, free, power, ends, summed=True
    ).normal
    combined, at = _make_combinations(len(free), shapes, len(targets))
    first_target = combined.shape[1] - len(targets)
    return ColumnProducts(combined.T @ normal @ combined, free, shapes, at, first_target)


def drop_wild_windows(problem: Problem, theta: Floats, power: Floats) -> Problem:
    """Return the problem without windows that magnify errors of their start far more than most.

    They decide nothing (see `cross_validation.find_tame` and `judge.compute_lead`).
    """
    windows = problem.windows
    if len(windows) < 2:
        return problem
    tame = find_tame(linearise(problem, theta, windows.start_states, (), power))
    return replace(problem, windows=windows.pick(tame))


def _make_combinations(
    free: int, shapes: tuple[EffectShape, ...], targets: int
) -> tuple[Floats, tuple[int, ...]]:
    """Return the matrix that makes columns of steps, and where each shape begins.

    A move is the difference of two steps.
    """
    counts = [len(s.alone) + len(s.moved) + (1 if len(s.moved) else 0) for s in shapes]
    unit = np.eye(free + sum(counts) + targets)
    rows: list[Floats] = list(unit[:free])
    at, step = [], free
    for shape, count in zip(shapes, counts, strict=True):
        at.append(len(rows))
        sizes, moves = len(shape.alone), len(shape.moved)
        rows += list(unit[step : step + sizes])
        rows += [unit[step + sizes + k] - unit[step + sizes + moves] for k in range(moves)]
        step += count
    rows += list(unit[step:])
    return np.array(rows).T, tuple(at)


def compute_rest(columns: ColumnProducts, target: Floats, shape: int | None = None) -> Rest:
    """Return what is left of a target beside the free parameters and one shape.

    Sizes that have one sign keep it; an effect that is on or off is taken whole.

    target: (columns,) coefficients of a combination of columns.
    shape: its index; None for the free parameters alone.
    """
    always, signed = list(range(len(columns.free))), []
    if shape is not None:
        law, own = columns.shapes[shape], columns.list_columns(shape)
        if law.on_or_off:
            target = target.copy()
            target[own] -= 1.0
        else:
            sizes = own[: len(law.alone)]
            signed = [int(k) for k, has_sign in zip(sizes, law.one_way, strict=True) if has_sign]
            always += [int(k) for k in own if int(k) not in signed]
    rests = [
        _project(columns.normal, target, np.array([*always, *some], dtype=np.int64), len(always))
        for count in range(len(signed), -1, -1)
        for some in itertools.combinations(signed, count)
    ]
    return min(
        (residual for residual in rests if residual is not None),
        key=lambda residual: residual.distance,
    )


def _project(normal: Floats, target: Floats, taking: Ints, free: int) -> Rest | None:
    """Return what is left of a target when some columns take what they can.

    None where a coefficient after the first `free` ones would be negative.
    """
    own = normal[np.ix_(taking, taking)]
    scale = np.sqrt(np.maximum(np.diag(own), 1e-300))
    own = own / np.outer(scale, scale)
    along = (normal[taking] @ target) / scale
    taken = np.linalg.lstsq(own, along, rcond=1e-11)[0]
    if np.any(taken[free:] < 0.0):
        return None
    square = float(target @ normal @ target - 2 * taken @ along + taken @ own @ taken)
    return Rest(float(np.sqrt(max(square, 0.0))), taking, taken / scale)


def make_nearest_theta(
    columns: ColumnProducts, theta: Floats, shape: int, residual: Rest
) -> Floats:
    """Return theta (SIZE,) of the twin with a shape that comes nearest, to first order.

    All parameters stay within their bounds.
    """
    law, own = columns.shapes[shape], columns.list_columns(shape)
    coefficient = dict(zip(residual.columns.tolist(), residual.coefficients.tolist(), strict=True))
    nearest, slot = theta.copy(), SLOTS[law.effect.name]
    nearest[slot] = law.whole[slot]
    if not law.on_or_off:
        sizes = [k for k, p in enumerate(law.effect.parameters) if not p.shape]
        for k, column in zip(sizes, own, strict=False):
            p = law.effect.parameters[k]
            step = coefficient.get(int(column), 0.0) * (law.whole[slot.start + k] - p.neutral)
            nearest[slot.start + k] = np.clip(p.neutral + step, p.low, p.high)
    for k, free in enumerate(columns.free):
        value = free.get(theta) + coefficient.get(k, 0.0) * free.size
        free.put(nearest, float(np.clip(value, free.low, free.high)))
    return nearest


def compute_deviations(normal: Floats, sums: Floats | None = None) -> Floats:
    """Return the standard deviations (values,) of sums of parameters with these normal equations.

    Infinite where the equations do not fix a sum.

    sums: (values, parameters) of the parameters, in their sizes, that make each value; None for
        the parameters themselves.
    """
    values, vectors = np.linalg.eigh(normal)
    blind = values < 1e-10 * max(values.max(), 1e-300)
    along = (vectors if sums is None else sums @ vectors) ** 2
    variance = along @ (1.0 / np.where(blind, np.inf, values))
    return np.sqrt(np.where(along @ blind > 1e-6 * along.sum(axis=1), np.inf, variance))
