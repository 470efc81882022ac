"""The reward of a step: a pure function of the measured state (thesis, equation 27)."""

from __future__ import annotations

import math

from pendulum_rl_env.arithmetic import compiled
from pendulum_rl_env.task import Task, find_end_number
from pendulum_twin.arrays import Floats


@compiled
def compute_shaped_reward(x, th, v, w, limits):
    """Return equation 27 for a state within the limits: 0 to 1, 1 upright at rest in the middle.

    R = (1 - |a/pi|) (W - |w|)/W (0.75 (X - |x|)/X + 0.25 (V - |v|)/V), a the angle from upright,
    -pi to pi.
    """
    a = th - 2.0 * math.pi * math.floor(th / (2.0 * math.pi) + 0.5)
    place = 0.75 * (limits[0] - abs(x)) / limits[0] + 0.25 * (limits[1] - abs(v)) / limits[1]
    return (1.0 - abs(a / math.pi)) * (limits[2] - abs(w)) / limits[2] * place


@compiled
def compute_reward_and_end(x, th, v, w, limits, penalties):
    """Return the reward of arriving at a state, and the number of its `End`."""
    end = find_end_number(x, v, w, limits)
    if end == 0:
        return compute_shaped_reward(x, th, v, w, limits), end
    return penalties[0] if end == 1 else penalties[1], end


def compute_reward(state: Floats, task: Task) -> float:
    """Return the reward of arriving at a state: equation 27, or the penalty beyond a limit.

    state: (4,) measured x (m), th (rad, 0 upright), v (m/s), w (rad/s).
    """
    x, th, v, w = (float(value) for value in state)
    return float(compute_reward_and_end(x, th, v, w, task.limits, task.penalties)[0])
