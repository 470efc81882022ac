"""The task's reward with rounded corners, for methods that need its derivatives.

Equation 27 is a product of factors with corners where angle, place and speeds are zero. A corner
|y| becomes sqrt(y^2 + e^2) - e. Beyond the task's limits the smooth reward falls on.
"""

from __future__ import annotations

import math

import numpy as np

from pendulum_rl_env.task import Task
from pendulum_twin.arrays import Floats

CORNERS = np.array([0.02, 0.1, 0.1, 0.5])  # m, rad, m/s, rad/s; of x, th, v, w at roundness 1
MARGIN_SHARE = 0.97  # of a limit, beyond which a penalty grows
STEEPNESS = 2000.0  # of that penalty, for a distance of the whole limit


def compute_smooth_reward(
    shown: Floats, task: Task, roundness: float
) -> tuple[Floats, Floats, Floats]:
    """Return value (n,), gradient (n, 4) and Hessian (n, 4, 4) at measured states (n, 4).

    roundness: 1; of the corners, in units of `CORNERS`.
    """
    wrapped = shown.copy()
    wrapped[:, 1] = np.remainder(shown[:, 1] + math.pi, 2 * math.pi) - math.pi
    corner = roundness * CORNERS
    size = np.sqrt(wrapped**2 + corner**2)
    value, first, second = size - corner, wrapped / size, corner**2 / size**3
    x_limit, v_limit, w_limit = task.limits
    scale = np.array([0.75 / x_limit, 1.0 / math.pi, 0.25 / v_limit, 1.0 / w_limit])
    value, first, second = value * scale, first * scale, second * scale
    # the product of three factors: upright, slow, in the middle
    factors = np.stack([1.0 - value[:, 1], 1.0 - value[:, 3], 1.0 - value[:, 0] - value[:, 2]], 1)
    of = np.array([2, 0, 2, 1])  # the factor in which x, th, v, w stand
    n = len(shown)
    gradient, hessian = np.empty((n, 4)), np.empty((n, 4, 4))
    for i in range(4):
        others = np.prod(np.delete(factors, of[i], axis=1), axis=1)
        gradient[:, i] = -first[:, i] * others
        for j in range(4):
            if of[i] == of[j]:
                hessian[:, i, j] = -second[:, i] * others if i == j else 0.0
            else:
                rest = factors[:, 3 - of[i] - of[j]]
                hessian[:, i, j] = first[:, i] * first[:, j] * rest
    total = np.prod(factors, axis=1)
    _add_penalties(wrapped, task, total, gradient, hessian)
    return total, gradient, hessian


def _add_penalties(
    shown: Floats, task: Task, total: Floats, gradient: Floats, hessian: Floats
) -> None:
    """Subtract what grows near the limits of x, v and w."""
    for i, limit in zip((0, 2, 3), task.limits, strict=True):
        beyond = np.maximum(np.abs(shown[:, i]) / limit - MARGIN_SHARE, 0.0)
        total -= STEEPNESS * beyond**2
        gradient[:, i] -= 2.0 * STEEPNESS * beyond * np.sign(shown[:, i]) / limit
        hessian[:, i, i] -= np.where(beyond > 0.0, 2.0 * STEEPNESS / limit**2, 0.0)
