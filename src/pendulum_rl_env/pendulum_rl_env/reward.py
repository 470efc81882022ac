"""The reward of a step, a pure function of the measured state (thesis, equation 27) and of why the episode ended."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pendulum_rl_env.arithmetic import compiled
from pendulum_rl_env.task import Task, find_end_number


@compiled
def compute_shaped_reward(x, th, v, w, limits):
    """Return equation 27 of a state within the limits, between 0 and 1: 1 upright and at rest in the middle.

    R = (1 - |a/pi|) (W - |w|)/W (0.75 (X - |x|)/X + 0.25 (V - |v|)/V), a the angle from upright,
    -pi to pi.
    """
    a = th - 2.0 * math.pi * math.floor(th / (2.0 * math.pi) + 0.5)
    place = 0.75 * (limits[0] - abs(x)) / limits[0] + 0.25 * (limits[1] - abs(v)) / limits[1]
    return (1.0 - abs(a / math.pi)) * (limits[2] - abs(w)) / limits[2] * place


@compiled
def compute_reward_and_end(x, th, v, w, limits, penalties):
    """Return the reward of having arrived at a state, and the number of the `End` that it is."""
    end = find_end_number(x, v, w, limits)
    if end == 0:
        return compute_shaped_reward(x, th, v, w, limits), end
    return penalties[0] if end == 1 else penalties[1], end


def compute_reward(state: NDArray[np.float64], task: Task) -> float:
    """Return the reward of having arrived at a measured state x, th, v, w (SI units): see `compute_shaped_reward` and `Task`."""
    x, th, v, w = (float(value) for value in state)
    return float(compute_reward_and_end(x, th, v, w, task.limits, task.penalties)[0])
