"""The ways in which an effect may show on a rig: at typical sizes, in all its shapes."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.fitting.parameters import Scales, compute_size
from pendulum_twin.arrays import Floats
from pendulum_twin.effects import CATALOGUE
from pendulum_twin.effects.effect import Effect, Form, Parameter, Place
from pendulum_twin.parameter_vector import SLOTS
from pendulum_twin.rig import Rig

# Part of a shape's value (or of its size at 0) by which it is moved to see how neighbours show.
MOVED = 0.05


@dataclass(frozen=True)
class EffectShape:
    """Hold one way in which an effect may show, to compare with a twin without it.

    An effect that is on or off, or that has shape parameters only, has one size: all of it.

    effect: as the catalogue has it.
    whole: (SIZE,) theta with all sizes typical.
    alone: (sizes, SIZE) theta with each size typical, the others 0.
    one_way: of each size, whether it has one sign only.
    moved: (shapes, SIZE) whole, with one shape parameter moved a little.
    scales: of each parameter, in its own unit.
    """

    effect: Effect
    whole: Floats
    alone: Floats
    one_way: tuple[bool, ...]
    moved: Floats
    scales: tuple[float, ...]

    @property
    def on_or_off(self) -> bool:
        """Return whether there is no size to choose."""
        return not self.effect.parameters

    def between(self, theta: Floats, share: float) -> Floats:
        """Return theta (SIZE,) with a share of the effect, 1 for all of it; its shape stays.

        An effect that has no size but a limit vanishes where the limit is what is reached at most,
        its scale.
        """
        moved, slot = theta.copy(), SLOTS[self.effect.name]
        for k, p in enumerate(self.effect.parameters):
            full = self.whole[slot.start + k]
            nothing = self.scales[k] if p.idle_beyond is not None else p.neutral
            moved[slot.start + k] = (
                full if self.effect.sizes and p.shape else nothing + share * (full - nothing)
            )
        return moved


def list_possible_effects(rig: Rig) -> tuple[Effect, ...]:
    """Return the effects that a diagnosis may name on a rig, but those of reported velocities."""
    places = {Place.CLOCK, Place.SENSOR}
    places |= {Place.COMMAND, Place.DRIVE, Place.CART} if rig.has_cart else set()
    places |= {Place.POLE} if rig.has_pole else set()
    has_both = rig.has_cart and rig.has_pole
    possible = (e for e in CATALOGUE if e.searched and e.place in places)
    return tuple(
        e for e in possible if e.form is not Form.REPORT and (has_both or not e.needs_both_joints)
    )


def make_shapes(
    theta: Floats, effect: Effect, scales: Scales, share: float = 1.0
) -> list[EffectShape]:
    """Return the ways in which an effect may show beside the effects of a twin.

    theta: (SIZE,) of the twin.
    scales: of the recording.
    share: of the effect's typical size.
    """
    if not effect.parameters:
        return [make_shape_of(theta, effect, scales)]
    sizes = [compute_size(p, scales) for p in effect.parameters]
    combinations = list(
        itertools.product(*(p.probes if p.shape else p.probes[:1] for p in effect.parameters))
    )
    kept = np.unique(
        np.linspace(0, len(combinations) - 1, decisions.SHAPES_COMPARED).round().astype(int)
    )
    shapes = [
        _make_shape(
            theta, effect, [a * b for a, b in zip(combinations[k], sizes, strict=True)], sizes
        )
        for k in kept
    ]
    if share == 1.0:
        return shapes
    slot = SLOTS[effect.name]
    return [
        _make_shape(theta, effect, list(shape.between(theta, share)[slot]), sizes)
        for shape in shapes
    ]


def make_shape_of(theta: Floats, effect: Effect, scales: Scales) -> EffectShape:
    """Return the way in which theta (SIZE,) holds an effect; a switch counts as on."""
    if not effect.parameters:
        on = theta.copy()
        on[SLOTS[effect.name]] = 1.0
        return EffectShape(effect, on, on[None], (True,), np.empty((0, theta.size)), ())
    return _make_shape(
        theta,
        effect,
        list(theta[SLOTS[effect.name]]),
        [compute_size(p, scales) for p in effect.parameters],
    )


def choose_typical(shapes: list[EffectShape]) -> EffectShape:
    """Return the shape that stands for all of an effect's: the one in the middle."""
    return shapes[len(shapes) // 2]


def _make_shape(
    theta: Floats, effect: Effect, values: list[float], sizes: list[float]
) -> EffectShape:
    start = SLOTS[effect.name].start
    whole = theta.copy()
    whole[SLOTS[effect.name]] = values
    how_much = [k for k, p in enumerate(effect.parameters) if not p.shape]
    alone = []
    for k in how_much:
        theta_alone = whole.copy()
        for other in how_much:
            if other != k:
                theta_alone[start + other] = effect.parameters[other].neutral
        alone.append(theta_alone)
    moved = []
    for k, p in enumerate(effect.parameters):
        if p.shape and not p.located:
            step = MOVED * (abs(values[k]) or sizes[k])
            theta_moved = whole.copy()
            theta_moved[start + k] += step
            moved.append(theta_moved)
    one_way = tuple(_has_one_sign(effect.parameters[k]) for k in how_much) or (True,)
    return EffectShape(
        effect,
        whole,
        np.array(alone or [whole]),
        one_way,
        np.array(moved).reshape(-1, theta.size),
        tuple(sizes),
    )


def _has_one_sign(parameter: Parameter) -> bool:
    return parameter.low >= parameter.neutral or parameter.high <= parameter.neutral
