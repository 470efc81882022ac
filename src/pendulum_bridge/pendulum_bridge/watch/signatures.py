"""What may change about a rig: a signature for each way, as changes of the parameter vector."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pendulum_twin.arrays import Floats
from pendulum_twin.effects import BY_NAME
from pendulum_twin.effects.effect import Place
from pendulum_twin.effects.load_put_on import put_load_on
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import (
    BASE,
    COUPLING,
    GRAVITY,
    INERTIA,
    MASS,
    MOMENT,
    SLOTS,
)
from pendulum_twin.rig import RANGES, UNITS, Rig

WORTH_FORCE_SHARE = (
    0.015  # of the drive's largest force: change of the cart's force worth an alarm
)
WORTH_TORQUE_SHARE = 0.004  # of the pole's largest weight: change of its torque worth an alarm
LEAST_GRAVITY_M_S2 = 0.1  # below which a tilt is no push of a usual size
PROBE_SIZE = 2.0  # in units of what is worth an alarm: size at which a run's change is computed


@dataclass(frozen=True)
class Signature:
    """Hold a way in which a rig may change.

    effect: catalogue name, or the rig's key.
    place: of the chain.
    variable: what the force, torque or reading depends on.
    theta: places in the parameter vector that change.
    per_unit: by which they grow for each unit of the signature's size.
    unit: of its size.
    worth: above 0; size that is worth an alarm.
    least: the lowest size that can be.
    sentence: for a person, with {size} in it.
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
        """Tell whether the size may be negative by as much as is worth an alarm."""
        return self.least <= -self.worth


@dataclass(frozen=True)
class Kind:
    """Describe a signature for any rig.

    effect: catalogue name, or "rig" for a constant of the rig.
    parameter: of the effect, or the rig's key.
    place, variable, sentence: see `Signature`.
    worth: size worth an alarm, from the rig and the sample period in s.
    """

    effect: str
    parameter: str
    place: Place
    variable: str
    worth: Callable[[Rig, float], float]
    sentence: str


def compute_full_force_n(rig: Rig) -> float:
    """Return the drive's largest force, N; without a drive the cart's weight."""
    force = (rig.force_per_pwm_n or 0.0) * (rig.pwm_limit or 0.5)
    return force or rig.total_mass_kg * rig.gravity_m_s2


def compute_full_torque_n_m(rig: Rig) -> float:
    """Return the largest torque of the pole's weight, N m."""
    return rig.total_mass_kg * (rig.com_distance_m or 0.0) * rig.gravity_m_s2


def compute_swing_rad_s(rig: Rig) -> float:
    """Return the natural frequency of the hanging pole, rad/s; 1 without a pole."""
    if not rig.pole_inertia_kg_m2:
        return 1.0
    return float(np.sqrt(compute_full_torque_n_m(rig) / rig.pole_inertia_kg_m2))


def _worth_force_n(rig: Rig) -> float:
    return WORTH_FORCE_SHARE * compute_full_force_n(rig)


def _worth_torque_n_m(rig: Rig) -> float:
    return WORTH_TORQUE_SHARE * compute_full_torque_n_m(rig)


def _estimate_travel_m(rig: Rig) -> float:
    return (rig.rail_half_length_m or 0.9) / 3


KINDS: tuple[Kind, ...] = (
    Kind(
        "input_delay",
        "delay_s",
        Place.COMMAND,
        "command",
        lambda rig, period_s: 0.4 * period_s,
        "the command acts {size} later",
    ),
    Kind(
        "input_dead_zone",
        "width",
        Place.COMMAND,
        "command",
        lambda rig, period_s: WORTH_FORCE_SHARE * (rig.pwm_limit or 0.5),
        "a dead zone of the command is wider by {size}",
    ),
    Kind(
        "rig",
        "force_per_pwm_n",
        Place.DRIVE,
        "command",
        lambda rig, period_s: 0.03 * (rig.force_per_pwm_n or 1.0),
        "the drive's force for a unit of command has changed by {size}",
    ),
    Kind(
        "motor_lag",
        "time_constant_s",
        Place.DRIVE,
        "command_rate",
        lambda rig, period_s: 0.6 * period_s,
        "the force follows the command with a lag longer by {size}",
    ),
    Kind(
        "rig",
        "cart_mass_kg",
        Place.CART,
        "cart_acceleration",
        lambda rig, period_s: 0.03 * rig.total_mass_kg,
        "the cart's mass has changed by {size}",
    ),
    Kind(
        "rig",
        "cart_viscous_n_s_m",
        Place.CART,
        "cart_velocity",
        lambda rig, period_s: _worth_force_n(rig),
        "friction of the cart that grows with its speed has changed by {size}",
    ),
    Kind(
        "cart_coulomb_friction",
        "level_n",
        Place.CART,
        "cart_velocity",
        lambda rig, period_s: _worth_force_n(rig),
        "dry friction of the cart has changed by {size}",
    ),
    Kind(
        "rail_tilt",
        "angle_rad",
        Place.CART,
        "constant",
        lambda rig, period_s: (
            _worth_force_n(rig) / 2 / (rig.total_mass_kg * max(rig.gravity_m_s2, 0.1))
        ),
        "a constant force pushes the cart as a rail tilted by {size} would",
    ),
    Kind(
        "rail_spring",
        "n_per_m",
        Place.CART,
        "cart_position",
        lambda rig, period_s: _worth_force_n(rig) / _estimate_travel_m(rig),
        "a force pulls the cart back that grows by {size} along the rail",
    ),
    Kind(
        "rig",
        "pole_viscous_n_m_s",
        Place.POLE,
        "pole_rate",
        lambda rig, period_s: _worth_torque_n_m(rig) / compute_swing_rad_s(rig),
        "friction of the pole that grows with its rate has changed by {size}",
    ),
    Kind(
        "pole_coulomb_friction",
        "level_n_m",
        Place.POLE,
        "pole_rate",
        lambda rig, period_s: _worth_torque_n_m(rig),
        "dry friction of the pole has changed by {size}",
    ),
    Kind(
        "pole_spring",
        "n_m_per_rad",
        Place.POLE,
        "pole_angle",
        lambda rig, period_s: 2 * _worth_torque_n_m(rig),
        "a torque turns the pole back to hanging that grows by {size}",
    ),
    Kind(
        "rig",
        "com_distance_m",
        Place.POLE,
        "pole_angle",
        lambda rig, period_s: 0.03 * (rig.com_distance_m or 1.0),
        "the distance of the pole's centre of mass has changed by {size}",
    ),
    Kind(
        "rig",
        "pole_inertia_kg_m2",
        Place.POLE,
        "pole_angle",
        lambda rig, period_s: 0.03 * (rig.pole_inertia_kg_m2 or 1.0),
        "the pole's inertia has changed by {size}",
    ),
    Kind(
        "angle_offset",
        "angle_rad",
        Place.SENSOR,
        "pole_angle",
        lambda rig, period_s: 0.01,
        "the pole's encoder shows {size} more than before",
    ),
)
NEEDS_CART = (Place.COMMAND, Place.DRIVE, Place.CART)


def make_signatures(twin: Twin, period_s: float) -> tuple[Signature, ...]:
    """Return what may change about the twin's rig, sampled every period_s (s)."""
    rig = twin.rig
    return tuple(
        _make_signature(kind, twin, period_s)
        for kind in KINDS
        if (rig.has_cart if kind.place in NEEDS_CART else rig.has_pole)
    )


class _Quantity(NamedTuple):
    """Hold a number of the twin: its value now, its lowest value, and its places in theta."""

    value: float
    low: float
    unit: str
    theta: tuple[int, ...]
    per_unit: float = 1.0


def _make_signature(kind: Kind, twin: Twin, period_s: float) -> Signature:
    is_constant = kind.effect == "rig"
    quantity = _describe_constant(kind, twin) if is_constant else _describe_parameter(kind, twin)
    return Signature(
        kind.parameter if is_constant else kind.effect,
        kind.place,
        kind.variable,
        quantity.theta,
        quantity.per_unit,
        quantity.unit,
        kind.worth(twin.rig, period_s),
        quantity.low - quantity.value,
        kind.sentence,
    )


def _describe_constant(kind: Kind, twin: Twin) -> _Quantity:
    key = kind.parameter
    value, low, unit = float(getattr(twin.rig, key)), RANGES[key][0], UNITS[key]
    if key == "com_distance_m":
        return _Quantity(value, low, unit, (COUPLING, MOMENT), twin.rig.total_mass_kg)
    if key == "cart_mass_kg":  # a load on the cart: the pole's moment stays
        lightest = put_load_on(twin.rig, -value, 0.0).cart_mass_kg
        return _Quantity(value, lightest or low, unit, (MASS,))
    place = INERTIA if key == "pole_inertia_kg_m2" else BASE.index(key)
    return _Quantity(value, low, unit, (place,))


def _describe_parameter(kind: Kind, twin: Twin) -> _Quantity:
    parameters = BY_NAME[kind.effect].parameters
    number = [p.name for p in parameters].index(kind.parameter)
    parameter = parameters[number]
    value = twin.effects.get(kind.effect, {}).get(kind.parameter, parameter.neutral)
    place = SLOTS[kind.effect].start + number
    return _Quantity(value, parameter.low, parameter.unit, (place,))


def make_probes(theta: Floats, bank: tuple[Signature, ...]) -> Floats:
    """Return the twin's theta, and below it a row for each signature at its probe's size.

    (1 + signatures, SIZE).
    """
    rows = np.repeat(theta[None], 1 + len(bank), axis=0)
    for k, signature in enumerate(bank):
        rows[1 + k, signature.theta] += PROBE_SIZE * signature.worth * signature.per_unit
    return rows


def find_steady_push(theta: Floats) -> tuple[int, float]:
    """Return where a twin's theta (SIZE,) holds a steady push of the cart, and its size.

    The size accelerates the whole moving mass by 1 m/s^2. Where nothing weighs anything the size
    is that of a tenth of a m/s^2 of gravity, which pushes nothing.
    """
    (kind,) = (k for k in KINDS if k.place is Place.CART and k.variable == "constant")
    effect, constants = BY_NAME[kind.effect], {"mass_kg": 1.0}
    constants["gravity_m_s2"] = max(float(theta[GRAVITY]), LEAST_GRAVITY_M_S2)
    place = SLOTS[kind.effect].start + [p.name for p in effect.parameters].index(kind.parameter)
    at_rest = (0.0, 0.0, 0.0, 0.0)
    return place, 1.0 / effect.law(*at_rest, *(constants[c] for c in effect.constants), 1.0)


def collect_worths(bank: tuple[Signature, ...]) -> Floats:
    """Return the sizes worth an alarm, (signatures,), each in its unit."""
    return np.array([signature.worth for signature in bank])
