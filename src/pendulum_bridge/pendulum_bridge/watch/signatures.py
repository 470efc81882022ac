"""What may change about a rig: one signature each, by how the twin's run would change with it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pendulum_twin.arrays import Floats
from pendulum_twin.effects import BY_NAME
from pendulum_twin.effects.effect import Place
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import BASE, COUPLING, INERTIA, MOMENT, SLOTS
from pendulum_twin.rig import RANGES, UNITS, Rig

PUSH = 0.015  # of the largest force of the drive: a change of the force on the cart worth an alarm
TURN = 0.004  # of the pole's largest weight: a change of the torque on the pole worth an alarm
PROBE = 2.0  # times what is worth an alarm: the size at which the change of a run is computed


@dataclass(frozen=True)
class Signature:
    """Hold one way in which a rig may change.

    effect: catalogue name, or the rig's key. variable: what the force, torque or reading goes
    along with. words: their places among the twin's words, which grow by per_unit for each unit of
    its size. unit: of its size. worth: a change worth an alarm, above 0. least: the lowest change
    there can be. sentence: for a person, with {size} in it.
    """

    effect: str
    place: Place
    variable: str
    theta: tuple[int, ...]
    per_unit: float
    unit: str
    worth: float
    least: float
    sentence: str

    @property
    def falls(self) -> bool:
        """Tell whether it may get less by as much as is worth an alarm."""
        return self.least <= -self.worth


@dataclass(frozen=True)
class Kind:
    """Describe a signature before it is cut to a rig: worth gives a change worth an alarm from the rig and the period."""

    effect: str
    parameter: str
    place: Place
    variable: str
    worth: Callable[[Rig, float], float]
    sentence: str


def full_force_n(rig: Rig) -> float:
    """Return the largest force of the drive, N; the cart's weight for a rig without a drive."""
    force = (rig.force_per_pwm_n or 0.0) * (rig.pwm_limit or 0.5)
    return force or rig.total_mass_kg * rig.gravity_m_s2


def full_torque_n_m(rig: Rig) -> float:
    """Return the largest torque of the pole's weight, N m."""
    return rig.total_mass_kg * (rig.com_distance_m or 0.0) * rig.gravity_m_s2


def swing_rad_s(rig: Rig) -> float:
    """Return how fast the hanging pole swings, rad/s."""
    return (
        float(np.sqrt(full_torque_n_m(rig) / rig.pole_inertia_kg_m2))
        if rig.pole_inertia_kg_m2
        else 1.0
    )


def _travel_m(rig: Rig) -> float:
    return (rig.rail_half_length_m or 0.9) / 3


KINDS: tuple[Kind, ...] = (
    Kind("input_delay", "delay_s", Place.COMMAND, "command", lambda r, p: 0.4 * p, "the command acts {size} later"),
    Kind(
        "input_dead_zone", "width", Place.COMMAND, "command", lambda r, p: PUSH * (r.pwm_limit or 0.5),
        "a dead zone of the command is wider by {size}",
    ),
    Kind(
        "rig", "force_per_pwm_n", Place.DRIVE, "command", lambda r, p: 0.03 * (r.force_per_pwm_n or 1.0),
        "the drive's force for a unit of command has changed by {size}",
    ),
    Kind(
        "motor_lag", "time_constant_s", Place.DRIVE, "command_rate", lambda r, p: 0.6 * p,
        "the force follows the command with a lag longer by {size}",
    ),
    Kind(
        "rig", "cart_viscous_n_s_m", Place.CART, "cart_velocity", lambda r, p: PUSH * full_force_n(r),
        "friction of the cart that grows with its speed has changed by {size}",
    ),
    Kind(
        "cart_coulomb_friction", "level_n", Place.CART, "cart_velocity", lambda r, p: PUSH * full_force_n(r),
        "dry friction of the cart has changed by {size}",
    ),
    Kind(
        "rail_tilt", "angle_rad", Place.CART, "constant",
        lambda r, p: PUSH / 2 * full_force_n(r) / (r.total_mass_kg * max(r.gravity_m_s2, 0.1)),
        "a constant force pushes the cart as a rail tilted by {size} would",
    ),
    Kind(
        "rail_spring", "n_per_m", Place.CART, "cart_position", lambda r, p: PUSH * full_force_n(r) / _travel_m(r),
        "a force pulls the cart back that grows by {size} along the rail",
    ),
    Kind(
        "rig", "pole_viscous_n_m_s", Place.POLE, "pole_rate", lambda r, p: TURN * full_torque_n_m(r) / swing_rad_s(r),
        "friction of the pole that grows with its rate has changed by {size}",
    ),
    Kind(
        "pole_coulomb_friction", "level_n_m", Place.POLE, "pole_rate", lambda r, p: TURN * full_torque_n_m(r),
        "dry friction of the pole has changed by {size}",
    ),
    Kind(
        "pole_spring", "n_m_per_rad", Place.POLE, "pole_angle", lambda r, p: 2 * TURN * full_torque_n_m(r),
        "a torque turns the pole back to hanging that grows by {size}",
    ),
    Kind(
        "rig", "com_distance_m", Place.POLE, "pole_angle", lambda r, p: 0.03 * (r.com_distance_m or 1.0),
        "the distance of the pole's centre of mass has changed by {size}",
    ),
    Kind(
        "rig", "pole_inertia_kg_m2", Place.POLE, "pole_angle", lambda r, p: 0.03 * (r.pole_inertia_kg_m2 or 1.0),
        "the pole's inertia has changed by {size}",
    ),
    Kind(
        "angle_offset", "angle_rad", Place.SENSOR, "pole_angle", lambda r, p: 0.01,
        "the pole's encoder shows {size} more than before",
    ),
)  # fmt: skip
NEEDS_CART = (Place.COMMAND, Place.DRIVE, Place.CART)


def signatures(twin: Twin, period_s: float) -> tuple[Signature, ...]:
    """Return what may change about the rig that the twin describes."""
    rig = twin.rig
    return tuple(
        _cut(kind, twin, period_s)
        for kind in KINDS
        if (rig.has_cart if kind.place in NEEDS_CART else rig.has_pole)
    )


def _cut(kind: Kind, twin: Twin, period_s: float) -> Signature:
    here, low, unit, theta, per_unit = (
        _constant(kind, twin) if kind.effect == "rig" else _parameter(kind, twin)
    )
    worth, name = (
        kind.worth(twin.rig, period_s),
        kind.parameter if kind.effect == "rig" else kind.effect,
    )
    return Signature(
        name, kind.place, kind.variable, theta, per_unit, unit, worth, low - here, kind.sentence
    )


def _constant(kind: Kind, twin: Twin) -> tuple[float, float, str, tuple[int, ...], float]:
    """Return a rig's constant, its lowest value, unit, words, and what they are for a unit of it."""
    key = kind.parameter
    here = float(getattr(twin.rig, key))
    if key == "com_distance_m":
        return here, RANGES[key][0], UNITS[key], (COUPLING, MOMENT), twin.rig.total_mass_kg
    word = INERTIA if key == "pole_inertia_kg_m2" else BASE.index(key)
    return here, RANGES[key][0], UNITS[key], (word,), 1.0


def _parameter(kind: Kind, twin: Twin) -> tuple[float, float, str, tuple[int, ...], float]:
    """Return an effect's parameter as the twin has it, its lowest value, unit, word and 1."""
    parameters = BY_NAME[kind.effect].parameters
    at = [p.name for p in parameters].index(kind.parameter)
    here = twin.effects.get(kind.effect, {}).get(kind.parameter, parameters[at].neutral)
    return here, parameters[at].low, parameters[at].unit, (SLOTS[kind.effect].start + at,), 1.0


def probes(theta: Floats, bank: tuple[Signature, ...]) -> Floats:
    """Return the twin's words, and below them those of each signature at its probe's size, (1 + signatures, SIZE)."""
    rows = np.repeat(theta[None], 1 + len(bank), axis=0)
    for k, signature in enumerate(bank):
        rows[1 + k, signature.theta] += PROBE * signature.worth * signature.per_unit
    return rows


def worth_of(bank: tuple[Signature, ...]) -> Floats:
    """Return the changes worth an alarm, (signatures,), each in its unit."""
    return np.array([signature.worth for signature in bank])
