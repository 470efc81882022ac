"""Swinging up: the cart is accelerated so that the pole gains the energy that it has upright, and stays near the middle.

Source: Astrom and Furuta, Swinging up a pendulum by energy control, Automatica 36 (2000) 287: the
pole's energy grows by S cos(th) w times the cart's acceleration, so that acceleration takes the
sign of cos(th) w until there is enough of it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pendulum_rl_env.task import Task
from pendulum_twin.parameter_vector import GRAVITY, INERTIA, MOMENT, SLOTS

Floats = NDArray[np.float64]

FIRST_PUSH_ENERGY = (
    0.02  # of the energy between hanging and upright: with less the pole is given its first push
)
LIMIT_SHARE = 0.85  # of the task's limits is used


@dataclass(frozen=True)
class SwingUp:
    """Hold how the pole is swung up.

    gain: share of the largest acceleration for a lack of all energy, times 1. over: energy aimed
    at beyond that upright, as a share of that between hanging and upright. pull: acceleration
    towards the middle, 1/s^2, and its damping with it.
    first: the way of the first push, 1 or -1.
    """

    gain: float = 8.0
    over: float = 0.04
    pull: float = 4.0
    first: float = 1.0


def compute_potential(angle: float, theta: Floats) -> float:
    """Return the pole's potential energy (J) at a true angle: its weight's, and a spring's if it has one."""
    spring = float(theta[SLOTS["pole_spring"]][0])
    return (
        float(theta[MOMENT] * theta[GRAVITY]) * math.cos(angle)
        + 0.5 * spring * (angle - math.pi) ** 2
    )


def compute_energy(state: Floats, theta: Floats, upright_rad: float = 0.0) -> float:
    """Return the pole's energy as a share of that between hanging and upright: -1 hanging at rest, 0 upright at rest.

    upright_rad: the true angle at which it balances.
    """
    _, th, _, w = state.tolist()
    top = compute_potential(upright_rad, theta)
    return (0.5 * float(theta[INERTIA]) * w * w + compute_potential(th, theta) - top) / (
        top - compute_potential(math.pi, theta)
    )


def compute_acceleration(
    state: Floats,
    theta: Floats,
    strongest: float,
    how: SwingUp,
    task: Task,
    upright_rad: float = 0.0,
) -> float:
    """Return the cart's acceleration (m/s^2) that swings the pole up from a true state x, th, v, w.

    strongest: the largest that the drive gives, m/s^2; more is never asked for.
    """
    x, th, v, w = state.tolist()
    lack = how.over - compute_energy(state, theta, upright_rad)
    if lack > 1.0 + how.over - FIRST_PUSH_ENERGY:
        wanted = how.first * strongest
    else:
        along = w * math.cos(th)
        soft = 0.1 * math.sqrt(float(theta[MOMENT] * theta[GRAVITY] / theta[INERTIA]))
        wanted = strongest * _clip(how.gain * lack, 1.0) * _clip(along / soft, 1.0)
    wanted -= how.pull * x + math.sqrt(how.pull) * v
    return _keep_within_limits(_clip(wanted, strongest), x, v, strongest, task)


def _keep_within_limits(wanted: float, x: float, v: float, strongest: float, task: Task) -> float:
    """Return the acceleration, or as much of a brake as keeps the cart within its limits of speed and place."""
    stops_at = x + 0.5 * v * abs(v) / (0.8 * strongest)
    if abs(stops_at) > LIMIT_SHARE * task.x_limit_m and stops_at * v >= 0.0:
        return -math.copysign(strongest, stops_at)
    if abs(v) > LIMIT_SHARE * task.v_limit_m_s and wanted * v > 0.0:
        return 0.0
    return wanted


def _clip(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)
