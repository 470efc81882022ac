"""How far two hypotheses about a rig lie apart on given windows, in standard errors, before anything is fitted.

Each hypothesis is a column: the change that it makes of the free runs, in units of noise, with every window's start state
following (`gauss_newton.linearised`). What is left of one column when others, and the rig's constants, have taken what
they can is the distance: the square root of the noncentrality of the test between the two (Kay, Fundamentals of
Statistical Signal Processing II (1998), section 7.7; to first order in the sizes).
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from pendulum_sysid.gauss_newton import Problem, linearised
from pendulum_sysid.hypotheses import Shape
from pendulum_sysid.parameters import Free
from pendulum_sysid.records import Ints, Split, Windows
from pendulum_sysid.windows import SmoothState, shorter
from pendulum_twin.signals import Floats
from pendulum_twin.words import SLOTS

# Of two twins that lie d apart the right one is ahead by d/2 standard errors in the mean, so the wrong one is ahead once in
# 44 recordings at 4. It is also the lead (`judge.SURE`) that a diagnosis asks for.
APART = 4.0
FOUND = 5.0  # standard errors at which an effect is called found
MOST_WINDOWS = 60  # looked at, spread evenly: the rest tells the same
NOTHING = 1e-6  # standard errors: what shows less does not show


@dataclass(frozen=True)
class Columns:
    """Hold the products of all columns with each other, starts following: first the free parameters, then the shapes.

    normal: (columns, columns). free: what the first columns turn. at: of each shape its first column; its sizes stand there,
    then its moves. target: the column of a change that is asked about, None where none is.
    """

    normal: Floats
    free: tuple[Free, ...]
    shapes: tuple[Shape, ...]
    at: tuple[int, ...]
    target: int | None = None

    def of(self, k: int) -> Ints:
        """Return the columns of shape k."""
        return self.at[k] + np.arange(len(self.shapes[k].alone) + len(self.shapes[k].moves))


@dataclass(frozen=True)
class Rest:
    """Hold what is left of a column (standard errors), and what the others took: coefficients of (indices,)."""

    distance: float
    columns: Ints
    taken: Floats


def deciding(state: SmoothState, split: Split, parts: int = 1) -> tuple[Windows, float]:
    """Return windows that a diagnosis decides on, cut into parts, and for how many each of them stands."""
    begin = np.sort(np.concatenate([split.train.begin, split.choose.begin]))
    kept = np.unique(np.linspace(0, len(begin) - 1, MOST_WINDOWS).round().astype(int))
    chosen = Windows(begin[kept], split.train.samples, state.states[begin[kept]])
    return shorter(state, chosen, parts), len(begin) / len(kept)


def columns(
    problem: Problem,
    words: Floats,
    free: tuple[Free, ...],
    power: Floats,
    shapes: tuple[Shape, ...] = (),
    target: Floats | None = None,
) -> Columns:
    """Return the columns of free parameters, of shapes and of the change from words to target, both (SIZE,).

    power: (channels,) mean squared errors that count as noise.
    """
    steps = [row for one in shapes for row in (*one.alone, *one.moved, *([one.whole] if len(one.moved) else []))]
    steps += [] if target is None else [target]
    whole = np.array(steps).reshape(-1, words.size)
    normal = linearised(problem, words, problem.windows.starts, free, power, whole).normal
    combined, at = _combinations(len(free), len(whole), shapes, target is not None)
    last = combined.shape[1] - 1 if target is not None else None
    return Columns(combined.T @ normal @ combined, free, shapes, at, last)


def _combinations(free: int, steps: int, shapes: tuple[Shape, ...], target: bool) -> tuple[Floats, tuple[int, ...]]:
    """Return the matrix that makes columns of steps, a move being the difference of two, and where each shape begins."""
    made: list[Floats] = list(np.eye(free + steps)[:free])
    at, step = [], free
    unit = np.eye(free + steps)
    for one in shapes:
        at.append(len(made))
        sizes, moves = len(one.alone), len(one.moved)
        made += list(unit[step : step + sizes])
        made += [unit[step + sizes + k] - unit[step + sizes + moves] for k in range(moves)]
        step += sizes + moves + (1 if moves else 0)
    if target:
        made.append(unit[step])
    return np.array(made).reshape(-1, free + steps).T, tuple(at)


def rest(found: Columns, asked: Floats, shape: int | None = None) -> Rest:
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
    left = float(asked @ normal @ asked - 2 * taken @ along + taken @ (own / np.outer(scale, scale)) @ taken)
    return Rest(float(np.sqrt(max(left, 0.0))), taking, taken / scale)


def words_with(found: Columns, words: Floats, shape: int, left: Rest) -> Floats:
    """Return words (SIZE,) of the twin that comes nearest with this shape, to first order, within all bounds."""
    one, own = found.shapes[shape], found.of(shape)
    coefficient = dict(zip(left.columns.tolist(), left.taken.tolist(), strict=True))
    new, slot = words.copy(), SLOTS[one.effect.name]
    new[slot] = one.whole[slot]
    if not one.on_or_off:
        sizes = [k for k, p in enumerate(one.effect.parameters) if not p.shape]
        moves = [k for k, p in enumerate(one.effect.parameters) if p.shape and not p.located]
        for k, column in zip(sizes, own, strict=False):
            p = one.effect.parameters[k]
            far = coefficient.get(int(column), 0.0)
            new[slot.start + k] = np.clip(p.neutral + far * (one.whole[slot.start + k] - p.neutral), p.low, p.high)
    for k, free in enumerate(found.free):
        free.put(new, float(np.clip(free.get(words) + coefficient.get(k, 0.0) * free.size, free.low, free.high)))
    return new
