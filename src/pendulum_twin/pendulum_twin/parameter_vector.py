"""A twin as a flat vector of numbers, its words: the base model's constants first, then every effect's parameters.

The kernel, the fit and the live twin all speak in words; an effect that is absent has its neutral
values, so one compiled kernel runs every hypothesis.
"""

from __future__ import annotations

import numpy as np

from pendulum_twin.arrays import Floats, Mask
from pendulum_twin.effects import CATALOGUE
from pendulum_twin.effects.effect import Effect
from pendulum_twin.model import Twin

BASE = (
    "mass_kg",  # m: all that moves along the rail; LOCKED for a cart that nothing can push
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


# A locked cart is one too heavy to be moved by its pole; what is then commanded is the
# acceleration of its axis, in m/s^2.
LOCKED = 1e12


def _lay_out() -> tuple[dict[str, slice], int]:
    slots: dict[str, slice] = {}
    at = len(BASE)
    for effect in CATALOGUE:
        size = max(len(effect.parameters), 1)
        slots[effect.name] = slice(at, at + size)
        at += size
    return slots, at


SLOTS, SIZE = _lay_out()


def get_neutral_values(effect: Effect) -> tuple[float, ...]:
    """Return the words at which the effect vanishes."""
    return tuple(p.neutral for p in effect.parameters) or (0.0,)


NEUTRAL = np.concatenate(
    [np.zeros(len(BASE)), *(np.array(get_neutral_values(e)) for e in CATALOGUE)]
)
NEUTRAL.setflags(write=False)


def make_theta(twin: Twin) -> Floats:
    """Return the twin's words, shape (SIZE,)."""
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
    """Return which effects of the catalogue are on in any of the word vectors, shape (effects,); words (..., SIZE)."""
    differs = np.any(theta.reshape(-1, SIZE) != NEUTRAL, axis=0)
    return np.array([differs[SLOTS[e.name]].any() for e in CATALOGUE])
