"""The registered environment that runs over topics."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np

from pendulum_rl_env.env import PendulumEnv
from pendulum_rl_env.in_process import scale_actions
from pendulum_rl_env.nodes.topic_transport import TopicTransport
from pendulum_rl_env.reward import compute_reward
from pendulum_rl_env.task import HANGING, Task


def make_ros_env(
    namespace: str = "rig",
    lockstep: bool = False,
    step_s: float = 0.03,
    deadline_s: float = 1.0,
    reset_deadline_s: float = 60.0,
    render_mode: str | None = None,
    pwm_limit: float | None = None,
) -> gym.Env[Any, Any]:
    """Return `InvertedPendulumRos-v0`: the rig, or the twin, of a namespace.

    Actions are scaled as in `InvertedPendulum-v0`, so policies carry over. Close it in a
    `finally`. Arguments: see `TopicTransport`; render_mode "rgb_array" for pictures, "human" for a
    window. Without a pwm_limit commands go up to the task's own, a PWM fraction of 0.5. The caller
    limits the length of episodes, see `make_twin_env`.
    """
    task = Task.make_for_step(step_s).take_limit(pwm_limit)
    compute_reward(np.array(HANGING), task)  # compiles it; within a step there is no time
    transport = TopicTransport(
        namespace, lockstep, step_s, deadline_s, reset_deadline_s, pwm_limit
    )
    try:
        return scale_actions(PendulumEnv(transport, task, render_mode))
    except BaseException:  # a window without pygame, say: the node must not stay in the graph
        transport.close()
        raise
