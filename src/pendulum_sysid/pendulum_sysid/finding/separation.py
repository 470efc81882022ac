"""How far two hypotheses about a rig lie apart on given windows, in standard errors, before anything is fitted.

Each hypothesis is a column: the change that it makes of the free runs, in units of noise, with
every window's start state following (`gauss_newton.linearised`). What is left of one column when
others, and the rig's constants, have taken what
they can is the distance: the square root of the noncentrality of the test between the two (Kay,
Fundamentals of Statistical Signal Processing II (1998), section 7.7; to first order in the sizes).
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.smooth_state import SmoothState
from pendulum_sysid.finding.hypotheses import Shape
from pendulum_sysid.fitting.linearised import Problem, linearise
from pendulum_sysid.fitting.parameters import Free
from pendulum_sysid.fitting.windows import shorten_windows
from pendulum_sysid.records import Ints, Split, Windows
from pendulum_twin.effects import CATALOGUE
from pendulum_twin.effects.effect import Effect
from pendulum_twin.parameter_vector import SLOTS
from pendulum_twin.signals import Floats

# Of two twins that lie d apart the right one is ahead by d/2 standard errors in the mean, so the
# wrong one is ahead once in 44 recordings at 4. It is also the lead (`judge.SURE`) that a
# diagnosis asks for.
CERTAIN = 1.96  # deviations to either side of a 95 % interval
NOTHING = 1e-6  # standard errors: what shows less does not show


@dataclass(frozen=True)
class Columns:
    """Hold the products of all columns with each other, starts following: free parameters, shapes, targets.

    normal: (columns, columns). free: what the first columns turn. at: of each shape its first
    column; its sizes stand there, then its moves. target: the first column of the changes that are
    asked about.
    """

    normal: Floats
    free: tuple[Free, ...]
    shapes: tuple[Shape, ...]
    at: tuple[int, ...]
    target: int

    def of(self, k: int) -> Ints:
        """Return the columns of shape k."""
        return self.at[k] + np.arange(len(self.shapes[k].alone) + len(self.shapes[k].moved))

    def asked(self, k: int = 0) -> Floats:
        """Return target k as a combination of columns, (columns,)."""
        return np.eye(len(self.normal))[self.target + k]

    def shows(self, k: int) -> bool:
        """Return whether shape k changes anything that is measured."""
        return bool(np.any(np.diag(self.normal)[self.of(k)] > NOTHING**2))


@dataclass(frozen=True)
class Tie:
    """Say that a recording cannot part an effect that a fit holds from another one, or from the rig's constants.

    rival: the other effect; None for the rig's constants. distance: what is left of the effect
    when the rival and the constants have taken what they can, standard errors. theta: (SIZE,) of
    the twin with the rival in the effect's place, as near as it comes. by_no_motion: True where no
    recording of such a rig can part them.
    """

    effect: str
    rival: str | None
    distance: float
    theta: Floats
    by_no_motion: bool = False


@dataclass(frozen=True)
class Rest:
    """Hold what is left of a column (standard errors), and what the others took: coefficients of (indices,)."""

    distance: float
    columns: Ints
    taken: Floats


def pick_deciding_windows(
    state: SmoothState, split: Split, parts: int = 1
) -> tuple[Windows, float]:
    """Return windows that a diagnosis decides on, cut into parts, and for how many each of them stands."""
    begin = np.sort(np.concatenate([split.train.begin, split.choose.begin]))
    kept = spread_indices(len(begin))
    chosen = Windows(begin[kept], split.train.samples, state.states[begin[kept]])
    return shorten_windows(state, chosen, parts), len(begin) / len(kept)


def spread_indices(count: int, most: int | None = None) -> Ints:
    """Return indices of so many windows as are looked at, spread evenly over all of them."""
    most = most or decisions.WINDOWS_COMPARED
    return np.unique(np.linspace(0, count - 1, most).round().astype(np.int64))


def compute_naming_threshold(values: int) -> float:
    """Return how many standard errors a diagnosis needs to name an effect, given how many values it decides on.

    It looks at a third of them, which it did not fit. There a lead of d/2 standard errors is to be
    had (see APART), and the factor of misfit exp(d^2 / 4 values), for the heavy-tailed likelihood
    counts half (`judge.lead`).
    """
    return max(
        decisions.FOUND_STANDARD_ERRORS,
        2 * decisions.LEAD_STANDARD_ERRORS * np.sqrt(3.0),
        np.sqrt(4 * values * np.log(decisions.LEAD_MISFIT_RATIO)),
    )


def list_doubles(effect: Effect) -> tuple[Effect, ...]:
    """Return the effects that look the same as this one in every motion of a rig, whatever its constants."""
    found = (
        e
        for e in CATALOGUE
        if e.searched and (e.shows_as == effect.name or effect.shows_as == e.name)
    )
    return tuple(found)


def is_rival(other: Effect, effect: Effect) -> bool:
    """Return whether another effect could be mistaken for this one: not itself, not one that contains it, not its double."""
    double = other.shows_as is not None or other.name == effect.shows_as
    return other.name != effect.name and effect.name not in other.simpler and not double


def compute_columns(
    problem: Problem,
    theta: Floats,
    free: tuple[Free, ...],
    power: Floats,
    shapes: tuple[Shape, ...] = (),
    targets: Floats | None = None,
) -> Columns:
    """Return the columns of free parameters, of shapes, and of the changes from words to targets (targets, SIZE).

    power: (channels,) mean squared errors that count as noise.
    """
    asked = np.empty((0, theta.size)) if targets is None else targets
    steps = [
        row
        for one in shapes
        for row in (*one.alone, *one.moved, *([one.whole] if len(one.moved) else []))
    ]
    whole = np.concatenate([np.array(steps).reshape(-1, theta.size), asked])
    problem = drop_wild_windows(problem, theta, power)
    normal = linearise(problem, theta, problem.windows.starts, free, power, whole).normal
    combined, at = _combinations(len(free), shapes, len(asked))
    return Columns(
        combined.T @ normal @ combined, free, shapes, at, combined.shape[1] - len(asked)
    )


def drop_wild_windows(problem: Problem, theta: Floats, power: Floats) -> Problem:
    """Return the problem without windows that magnify errors of their start far more than most, as near upright.

    Much would show there if a twin were exact; in a real fit such windows decide nothing (see
    `judge.lead`).
    """
    windows = problem.windows
    if len(windows) < 2:
        return problem
    grown = np.trace(
        linearise(problem, theta, windows.starts, (), power).start_normal, axis1=1, axis2=2
    )
    return replace(
        problem, windows=windows.pick(grown <= decisions.START_ERROR_GROWTH**2 * np.median(grown))
    )


def _combinations(
    free: int, shapes: tuple[Shape, ...], targets: int
) -> tuple[Floats, tuple[int, ...]]:
    """Return the matrix that makes columns of steps, a move being the difference of two, and where each shape begins."""
    counts = [len(one.alone) + len(one.moved) + (1 if len(one.moved) else 0) for one in shapes]
    unit = np.eye(free + sum(counts) + targets)
    made: list[Floats] = list(unit[:free])
    at, step = [], free
    for one, count in zip(shapes, counts, strict=True):
        at.append(len(made))
        sizes, moves = len(one.alone), len(one.moved)
        made += list(unit[step : step + sizes])
        made += [unit[step + sizes + k] - unit[step + sizes + moves] for k in range(moves)]
        step += count
    made += list(unit[step:])
    return np.array(made).T, tuple(at)


def compute_rest(found: Columns, asked: Floats, shape: int | None = None) -> Rest:
    """Return what is left of a combination of columns, asked (columns,), beside the free parameters and one shape.

    Sizes that have one sign keep it; an effect that is on or off is taken whole.
    """
    always, signed = list(range(len(found.free))), []
    if shape is not None:
        one, own = found.shapes[shape], found.of(shape)
        if one.on_or_off:
            asked = asked.copy()
            asked[own] -= 1.0
        else:
            sizes = own[: len(one.alone)]
            signed = [int(k) for k, only in zip(sizes, one.one_way, strict=True) if only]
            always += [int(k) for k in own if int(k) not in signed]
    tried = [
        _least(found.normal, asked, np.array([*always, *some], dtype=np.int64), len(always))
        for count in range(len(signed), -1, -1)
        for some in itertools.combinations(signed, count)
    ]
    return min((one for one in tried if one is not None), key=lambda one: one.distance)


def _least(normal: Floats, asked: Floats, taking: Ints, free: int) -> Rest | None:
    """Return what is left when these columns take what they can; None where one after the free ones turns negative."""
    own = normal[np.ix_(taking, taking)]
    scale = np.sqrt(np.maximum(np.diag(own), 1e-300))
    along = (normal[taking] @ asked) / scale
    taken = np.linalg.lstsq(own / np.outer(scale, scale), along, rcond=1e-11)[0]
    if np.any(taken[free:] < 0.0):
        return None
    left = float(
        asked @ normal @ asked - 2 * taken @ along + taken @ (own / np.outer(scale, scale)) @ taken
    )
    return Rest(float(np.sqrt(max(left, 0.0))), taking, taken / scale)


def make_nearest_theta(found: Columns, theta: Floats, shape: int, left: Rest) -> Floats:
    """Return theta (SIZE,) of the twin that comes nearest with this shape, to first order, within all bounds."""
    one, own = found.shapes[shape], found.of(shape)
    coefficient = dict(zip(left.columns.tolist(), left.taken.tolist(), strict=True))
    new, slot = theta.copy(), SLOTS[one.effect.name]
    new[slot] = one.whole[slot]
    if not one.on_or_off:
        sizes = [k for k, p in enumerate(one.effect.parameters) if not p.shape]
        for k, column in zip(sizes, own, strict=False):
            p = one.effect.parameters[k]
            far = coefficient.get(int(column), 0.0)
            new[slot.start + k] = np.clip(
                p.neutral + far * (one.whole[slot.start + k] - p.neutral), p.low, p.high
            )
    for k, free in enumerate(found.free):
        free.put(
            new,
            float(
                np.clip(free.get(theta) + coefficient.get(k, 0.0) * free.size, free.low, free.high)
            ),
        )
    return new


def compute_deviations(normal: Floats) -> Floats:
    """Return the standard deviations of parameters with these normal equations, in their sizes; infinite where unfixed."""
    values, vectors = np.linalg.eigh(normal)
    blind = values < 1e-10 * max(values.max(), 1e-300)
    variance = (vectors**2) @ (1.0 / np.where(blind, np.inf, values))
    return np.sqrt(np.where((vectors**2 @ blind) > 1e-6, np.inf, variance))
