"""Lay out a twin as a flat vector of numbers, theta: constants, then all effects, then laws.

Kernel, fit and live twin share this layout. An effect that is absent has its neutral values, so
that one compiled kernel runs every hypothesis. Measured laws lie in a few slots behind the
effects, each with its kind, its knots and its values; an empty slot is all 0.
"""

from __future__ import annotations

import numpy as np

from pendulum_twin.arrays import Floats, Mask
from pendulum_twin.effects import CATALOGUE
from pendulum_twin.effects.effect import Effect
from pendulum_twin.laws import KINDS
from pendulum_twin.laws.kind import LawKind
from pendulum_twin.laws.law import MOST_KNOTS, MOST_LAWS, Law, compute_step
from pendulum_twin.model import Twin

BASE = (
    "mass_kg",  # m: all that moves along the rail; LOCKED for a cart that nothing moves
    "coupling_kg_m",  # S of the coupling terms; 0 when the pole is missing
    "moment_kg_m",  # S of gravity's torque on the pole
    "inertia_kg_m2",  # Jp
    "gravity_m_s2",
    "cart_viscous_n_s_m",
    "pole_viscous_n_m_s",
    "force_per_pwm_n",
)
MASS, COUPLING, MOMENT, INERTIA, GRAVITY, CART_VISCOUS, POLE_VISCOUS, FORCE_PER_PWM = range(
    len(BASE)
)

# A locked cart is too heavy to be moved by its pole; the command is then the acceleration of the
# axis, m/s^2.
LOCKED = 1e12


def _lay_out() -> tuple[dict[str, slice], int]:
    """Return where each effect's parameters lie in theta, and the size of theta."""
    slots: dict[str, slice] = {}
    at = len(BASE)
    for effect in CATALOGUE:
        size = max(len(effect.parameters), 1)
        slots[effect.name] = slice(at, at + size)
        at += size
    return slots, at


SLOTS, LAWS = _lay_out()  # LAWS: where the slots of measured laws begin
# where each effect's slot begins, and the last slot ends: slots follow each other without a gap
BEGINS = np.array([*(slot.start for slot in SLOTS.values()), LAWS])
# In a law's slot: 1 + its index in KINDS, number of knots, first knot, spacing of the knots (their
# ratio, where a law remembers); then the values.
KIND, KNOTS, FIRST, SPACING, VALUES = range(5)
LAW_SIZE = VALUES + MOST_KNOTS
SIZE = LAWS + MOST_LAWS * LAW_SIZE


def get_neutral_values(effect: Effect) -> tuple[float, ...]:
    """Return the numbers of theta at which the effect vanishes."""
    return tuple(p.neutral for p in effect.parameters) or (0.0,)


NEUTRAL = np.concatenate(
    [
        np.zeros(len(BASE)),
        *(np.array(get_neutral_values(e)) for e in CATALOGUE),
        np.zeros(SIZE - LAWS),
    ]
)
NEUTRAL.setflags(write=False)


def make_theta(twin: Twin) -> Floats:
    """Return the twin's parameter vector, shape (SIZE,)."""
    rig = twin.rig
    theta = NEUTRAL.copy()
    moment = rig.total_mass_kg * (rig.com_distance_m or 0.0)
    theta[: len(BASE)] = (
        rig.total_mass_kg if rig.has_cart else LOCKED,
        moment,
        moment,
        rig.pole_inertia_kg_m2 if rig.has_pole else 1.0,
        rig.gravity_m_s2,
        rig.cart_viscous_n_s_m or 0.0,
        rig.pole_viscous_n_m_s or 0.0,
        rig.force_per_pwm_n if rig.force_per_pwm_n is not None else LOCKED,
    )
    for name, values in twin.effects.items():
        theta[SLOTS[name]] = list(values.values()) or [1.0]
    for slot, (name, law) in enumerate(twin.measured_laws.items()):
        put_law(theta, slot, name, law)
    return theta


def put_law(theta: Floats, slot: int, name: str, law: Law) -> None:
    """Put a law into a slot, 0 to MOST_LAWS - 1, of theta (SIZE,)."""
    take_law_out(theta, slot)
    at = LAWS + slot * LAW_SIZE
    number = 1 + next(k for k, kind in enumerate(KINDS) if kind.name == name)
    step = compute_step(KINDS[number - 1], law.knots)
    theta[at : at + VALUES] = (number, len(law.knots), law.knots[0], step)
    theta[at + VALUES : at + VALUES + len(law.values)] = law.values


def take_law_out(theta: Floats, slot: int) -> None:
    """Empty a slot, 0 to MOST_LAWS - 1, of theta (SIZE,)."""
    at = LAWS + slot * LAW_SIZE
    theta[at : at + LAW_SIZE] = 0.0


def get_laws(theta: Floats) -> dict[str, Law]:
    """Return the measured laws that theta (SIZE,) holds, by the names of their kinds."""
    laws = {}
    for at in range(LAWS, SIZE, LAW_SIZE):
        number, count = int(theta[at + KIND]), int(theta[at + KNOTS])
        if number:
            kind, first, step = KINDS[number - 1], theta[at + FIRST], theta[at + SPACING]
            rising = np.arange(count)
            knots = first * step**rising if kind.remembers else first + step * rising
            values = theta[at + VALUES : at + VALUES + count]
            laws[kind.name] = Law(tuple(knots.tolist()), tuple(values.tolist()))
    return laws


def list_law_kinds(theta: Floats) -> list[LawKind]:
    """Return the kinds of the measured laws in any theta (..., SIZE), in the order of KINDS."""
    numbers = theta.reshape(-1, SIZE)[:, LAWS::LAW_SIZE]
    if not numbers.any():
        return []  # faster by far, and the usual case
    return [KINDS[int(number) - 1] for number in sorted(set(numbers.ravel().tolist())) if number]


def find_active_effects(theta: Floats) -> Mask:
    """Return which effects are on in any theta (..., SIZE), in catalogue order, (effects,)."""
    differs = np.any(theta.reshape(-1, SIZE)[:, :LAWS] != NEUTRAL[:LAWS], axis=0)
    return np.logical_or.reduceat(differs, BEGINS[:-1])
