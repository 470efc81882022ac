"""Swing-up by energy: the cart gives the pole the energy that it has upright, near the middle.

Source: Astrom and Furuta, Swinging up a pendulum by energy control, Automatica 36 (2000) 287. The
pole's energy grows by S cos(th) w times the cart's acceleration, so the acceleration takes the
sign of cos(th) w until there is enough energy.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from pendulum_rl_env.task import Task
from pendulum_twin.arrays import Floats
from pendulum_twin.parameter_vector import GRAVITY, INERTIA, MOMENT, SLOTS

FIRST_PUSH_ENERGY = 0.02  # of hanging to upright: with less the pole gets its first push
LIMIT_SHARE = 0.85  # of the task's limits, that the swing-up uses
SOFT_RATE_SHARE = 0.1  # of the pole's own rate: below it a change of the push's sign is gradual
BRAKE_SHARE = 0.8  # of the largest acceleration, that a braking distance counts on


@dataclass(frozen=True)
class SwingUp:
    """Hold how the pole is swung up.

    gain: 1; share of the largest acceleration for a lack of all energy.
    over: 1; energy aimed at beyond upright, as a share of that between hanging and upright.
    pull: 1/s^2; acceleration towards the middle a metre; its damping comes with it.
    first: 1 or -1; direction of the first push.
    """

    gain: float = 8.0
    over: float = 0.04
    pull: float = 4.0
    first: float = 1.0


def compute_potential(angle: float, theta: Floats) -> float:
    """Return the pole's potential energy (J) at a true angle: of its weight and of a spring."""
    spring = float(theta[SLOTS["pole_spring"]][0])
    weight = float(theta[MOMENT] * theta[GRAVITY]) * math.cos(angle)
    return weight + 0.5 * spring * (angle - math.pi) ** 2


def compute_energy(state: Floats, theta: Floats, upright_rad: float = 0.0) -> float:
    """Return the pole's energy as a share: -1 hanging at rest, 0 upright at rest.

    state: (4,) true x, th, v, w.
    theta: parameter vector of the twin.
    upright_rad: true angle at which the pole balances.
    """
    _, th, _, w = state.tolist()
    top = compute_potential(upright_rad, theta)
    total = 0.5 * float(theta[INERTIA]) * w * w + compute_potential(th, theta)
    return (total - top) / (top - compute_potential(math.pi, theta))


def compute_acceleration(
    state: Floats,
    theta: Floats,
    strongest: float,
    how: SwingUp,
    task: Task,
    upright_rad: float = 0.0,
) -> float:
    """Return the cart's acceleration (m/s^2) that swings the pole up.

    state: (4,) true x, th, v, w.
    theta: parameter vector of the twin.
    strongest: m/s^2; the largest acceleration that the drive gives.
    how: numbers of the swing-up.
    task: its limits of place and speed are kept.
    upright_rad: true angle at which the pole balances.
    """
    x, th, v, w = state.tolist()
    lack = how.over - compute_energy(state, theta, upright_rad)
    if lack > 1.0 + how.over - FIRST_PUSH_ENERGY:
        wanted = how.first * strongest
    else:
        own_rate = math.sqrt(float(theta[MOMENT] * theta[GRAVITY] / theta[INERTIA]))
        along = w * math.cos(th) / (SOFT_RATE_SHARE * own_rate)
        wanted = strongest * _clip(how.gain * lack, 1.0) * _clip(along, 1.0)
    wanted -= how.pull * x + math.sqrt(how.pull) * v
    return _keep_within_limits(_clip(wanted, strongest), x, v, strongest, task)


def _keep_within_limits(wanted: float, x: float, v: float, strongest: float, task: Task) -> float:
    """Return the acceleration, or the brake that keeps the cart within place and speed."""
    stops_at = x + 0.5 * v * abs(v) / (BRAKE_SHARE * strongest)
    if abs(stops_at) > LIMIT_SHARE * task.x_limit_m and stops_at * v >= 0.0:
        return -math.copysign(strongest, stops_at)
    if abs(v) > LIMIT_SHARE * task.v_limit_m_s and wanted * v > 0.0:
        return 0.0
    return wanted


def _clip(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)
