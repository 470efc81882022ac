"""The ways in which an effect may show on a rig: its typical sizes, and the shapes that it may have."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from pendulum_sysid.parameters import Scales, size_of
from pendulum_twin.effects import CATALOGUE
from pendulum_twin.effects.effect import Effect, Parameter, Place
from pendulum_twin.rig import Rig
from pendulum_twin.signals import Floats
from pendulum_twin.words import SLOTS

MOST_SHAPES = 12  # of one effect; more are thinned out evenly, and what lies between is reached by moving a shape
MOVED = 0.05  # of a shape's value (or of its size at 0), by which it is moved to see how its neighbours show


@dataclass(frozen=True)
class Shape:
    """Hold one way in which an effect may show, as words to compare with those of a twin without it.

    whole: (SIZE,) all sizes typical. alone: (sizes, SIZE) each size typical, the others 0. one_way: of each size, whether
    it has one sign only. moved: (shapes, SIZE) whole, with one shape parameter moved a little; moves: by how much.
    An effect that is on or off, and one that has shape parameters only, has one size: all of it.
    """

    effect: Effect
    whole: Floats
    alone: Floats
    one_way: tuple[bool, ...]
    moved: Floats
    moves: Floats

    @property
    def on_or_off(self) -> bool:
        """Return whether there is no size to choose."""
        return not self.effect.parameters

    def between(self, words: Floats, share: float) -> Floats:
        """Return words (SIZE,) with a share of the effect, 1 for all of it; its shape stays, a limit comes nearer."""
        found, slot = words.copy(), SLOTS[self.effect.name].start
        sizes = [k for k, p in enumerate(self.effect.parameters) if not p.shape]
        for k, p in enumerate(self.effect.parameters):
            full = self.whole[slot + k]
            if k in sizes:
                full = p.neutral + share * (full - p.neutral)
            elif not sizes:  # a limit acts the less the nearer it is to what is never reached
                full = full * (1.0 + (1.0 - share) * (1.0 / p.probes[0] - 1.0))
            found[slot + k] = full
        return found


def possible(rig: Rig) -> tuple[Effect, ...]:
    """Return the effects that a diagnosis may name on a rig."""
    places = {Place.CLOCK, Place.SENSOR}
    places |= {Place.COMMAND, Place.DRIVE, Place.CART} if rig.has_cart else set()
    places |= {Place.POLE} if rig.has_pole else set()
    return tuple(e for e in CATALOGUE if e.searched and e.place in places)


def shapes(words: Floats, effect: Effect, scales: Scales) -> list[Shape]:
    """Return the ways in which an effect may show beside what words (SIZE,) hold; scales: of the recording."""
    if not effect.parameters:
        on = words.copy()
        on[SLOTS[effect.name]] = 1.0
        return [Shape(effect, on, on[None], (True,), np.empty((0, words.size)), np.empty(0))]
    sizes = [size_of(p, scales) for p in effect.parameters]
    choices = [p.probes if p.shape else p.probes[:1] for p in effect.parameters]
    combinations = list(itertools.product(*choices))
    kept = np.unique(np.linspace(0, len(combinations) - 1, MOST_SHAPES).round().astype(int))
    return [_shape(words, effect, [a * b for a, b in zip(combinations[k], sizes, strict=True)], sizes) for k in kept]


def shape_of(words: Floats, effect: Effect, scales: Scales) -> Shape:
    """Return the one way in which words (SIZE,) hold an effect."""
    values = list(words[SLOTS[effect.name]])
    if not effect.parameters:
        return shapes(words, effect, scales)[0]
    return _shape(words, effect, values, [size_of(p, scales) for p in effect.parameters])


def typical(found: list[Shape]) -> Shape:
    """Return the shape that stands for all of an effect's: the one in the middle."""
    return found[len(found) // 2]


def _shape(words: Floats, effect: Effect, values: list[float], sizes: list[float]) -> Shape:
    start = SLOTS[effect.name].start
    whole = words.copy()
    whole[SLOTS[effect.name]] = values
    how_much = [k for k, p in enumerate(effect.parameters) if not p.shape]
    alone = []
    for k in how_much:
        one = whole.copy()
        for other in how_much:
            if other != k:
                one[start + other] = effect.parameters[other].neutral
        alone.append(one)
    moved, moves = [], []
    for k, p in enumerate(effect.parameters):
        if p.shape and not p.located:
            step = MOVED * (abs(values[k]) or sizes[k])
            one = whole.copy()
            one[start + k] += step
            moved.append(one)
            moves.append(step)
    one_way = tuple(_one_way(effect.parameters[k]) for k in how_much) or (True,)
    return Shape(effect, whole, np.array(alone or [whole]), one_way, np.array(moved).reshape(-1, words.size), np.array(moves))


def _one_way(parameter: Parameter) -> bool:
    return parameter.low >= parameter.neutral or parameter.high <= parameter.neutral
