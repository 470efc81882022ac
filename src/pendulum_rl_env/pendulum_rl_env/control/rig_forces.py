"""What pushes cart and pole of a twin at a state, and the drive that a wanted acceleration of the cart takes."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pendulum_twin.machine_code import make_cached_compiler
from pendulum_twin.motion import ALL_LAWS, compute_cart_level, sum_forces
from pendulum_twin.parameter_vector import FORCE_PER_PWM, INERTIA, MASS

Floats = NDArray[np.float64]

compiled = make_cached_compiler(Path(__file__))


class Forces(NamedTuple):
    """Hold what acts without drive: push on the cart (N), level of its dry friction (N), torque on the pole (N m).

    coupling: S cos th, kg m.
    """

    push: float
    level: float
    turn: float
    coupling: float


@compiled
def _sum_forces(x, th, v, w, way, theta):  # type: ignore[no-untyped-def]
    push, turn, coupling = sum_forces((x, th, v, w), 0.0, theta, 0, 1, ALL_LAWS)
    return push, compute_cart_level(abs(v), x, way, theta, 0, 1, ALL_LAWS), turn, coupling


def compute_forces(state: Floats, theta: Floats, way: float = 1.0) -> Forces:
    """Return what acts at a true state x, th, v, w; way: in which the cart moves, or wants to, 1 or -1."""
    x, th, v, w = state.tolist()
    return Forces(*_sum_forces(x, th, v, w, way, theta))


def compute_drive(acceleration: float, way: float, state: Floats, theta: Floats) -> float:
    """Return the drive that accelerates the cart so (m/s^2) at a true state.

    way: in which the cart moves or is to move, -1 to 1: dry friction is overcome by that share,
    the pole's own is left out.
    """
    push, level, turn, coupling = compute_forces(state, theta, 1.0 if way >= 0.0 else -1.0)
    swing = (turn + coupling * acceleration) / float(theta[INERTIA])
    force = float(theta[MASS]) * acceleration - coupling * swing - push + way * level
    return force / float(theta[FORCE_PER_PWM])
