"""Lay out a twin as a flat vector of numbers, theta: the base model's constants, then all effects.

Kernel, fit and live twin share this layout. An effect that is absent has its neutral values, so
that one compiled kernel runs every hypothesis.
"""

from __future__ import annotations

import numpy as np

from pendulum_twin.arrays import Floats, Mask
from pendulum_twin.effects import CATALOGUE
from pendulum_twin.effects.effect import Effect
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


SLOTS, SIZE = _lay_out()


def get_neutral_values(effect: Effect) -> tuple[float, ...]:
    """Return the numbers of theta at which the effect vanishes."""
    return tuple(p.neutral for p in effect.parameters) or (0.0,)


NEUTRAL = np.concatenate(
    [np.zeros(len(BASE)), *(np.array(get_neutral_values(e)) for e in CATALOGUE)]
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
    return theta


def find_active_effects(theta: Floats) -> Mask:
    """Return which effects are on in any theta (..., SIZE), in catalogue order, (effects,)."""
    differs = np.any(theta.reshape(-1, SIZE) != NEUTRAL, axis=0)
    return np.array([differs[SLOTS[e.name]].any() for e in CATALOGUE])
