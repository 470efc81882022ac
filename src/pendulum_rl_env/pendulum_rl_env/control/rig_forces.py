"""Forces on cart and pole of a twin at a state, and the drive for a wanted acceleration."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from pendulum_twin.arrays import Floats
from pendulum_twin.hysteresis import sum_cart_levels
from pendulum_twin.law_curves import sum_measured_laws
from pendulum_twin.machine_code import make_cached_compiler
from pendulum_twin.motion import (
    ALL_LAWS,
    compute_cart_level,
    sum_costly_laws,
    sum_forces,
    sum_held_effects,
    sum_path_forces,
)
from pendulum_twin.parameter_vector import FORCE_PER_PWM, INERTIA, MASS

LEAST_GAIN = 0.1  # of the twin's; a place where the drive hardly acts is not asked for more

FAR_M = 1e3  # after such a way, the friction that follows the path is that of slipping

compiled = make_cached_compiler(Path(__file__))


class Forces(NamedTuple):
    """Hold what acts without drive.

    push: N; on the cart.
    level: N; of the cart's dry friction.
    turn: N m; torque on the pole.
    coupling: kg m; S cos th.
    gain: of the drive there, 1 without laws that change it.
    """

    push: float
    level: float
    turn: float
    coupling: float
    gain: float


@compiled
def _sum_forces(x, th, v, w, way, theta):  # type: ignore[no-untyped-def]
    gain, force, torque, cart_dry, pole_dry = sum_measured_laws(theta, x, v, th, w, 0.0, 0.0)
    held_gain, held_force, held_dry, drag = sum_held_effects(x, th, w, 0.0, theta, 0, 1)
    gain *= held_gain
    evenly = force + held_force - drag * v, torque, cart_dry + held_dry, pole_dry
    applied = evenly + sum_costly_laws(x, th, v, w, theta, 0, 1)
    push, turn, coupling = sum_forces((x, th, v, w), applied, theta, 0, 1, ALL_LAWS)
    level = compute_cart_level(abs(v), x, way, applied, theta, 0, 1)
    # whatever force there was before (here the first number of theta)
    level -= way * sum_path_forces(0, way * FAR_M, theta, 0, 1)
    level += sum_cart_levels(theta)
    return push, level, turn, coupling, gain


def compute_forces(state: Floats, theta: Floats, way: float = 1.0) -> Forces:
    """Return what acts at a state.

    state: (4,) true x, th, v, w.
    theta: parameter vector of the twin.
    way: 1 or -1, direction in which the cart moves or is about to.
    """
    x, th, v, w = state.tolist()
    return Forces(*_sum_forces(x, th, v, w, way, theta))


def compute_drive(acceleration: float, way: float, state: Floats, theta: Floats) -> float:
    """Return the drive that accelerates the cart as wanted; the pole's dry friction is left out.

    acceleration: m/s^2; of the cart.
    way: -1 to 1, direction in which the cart moves or is about to; its size is the share of dry
        friction that is overcome.
    state: (4,) true x, th, v, w.
    theta: parameter vector of the twin.
    """
    push, level, turn, coupling, gain = compute_forces(state, theta, 1.0 if way >= 0.0 else -1.0)
    swing = (turn + coupling * acceleration) / float(theta[INERTIA])
    force = float(theta[MASS]) * acceleration - coupling * swing - push + way * level
    return force / (float(theta[FORCE_PER_PWM]) * max(gain, LEAST_GAIN))
