"""Register the environments with Gymnasium."""

from __future__ import annotations

import gymnasium as gym

from pendulum_rl_env.learning.result import SOLVED_MEAN_REWARD

TORQUE_SOLVED_MEAN_REWARD = 390  # thesis, section 4.2


def register_environments() -> None:
    """Make the ids known to Gymnasium; once they are known a further call does nothing."""
    if "pendulum_rl_env/InvertedPendulum-v0" in gym.registry:
        return
    gym.register(
        "pendulum_rl_env/InvertedPendulum-v0",
        entry_point="pendulum_rl_env.in_process:make_twin_env",
        vector_entry_point="pendulum_rl_env.in_process:make_twin_vector_env",
        max_episode_steps=512,
        reward_threshold=SOLVED_MEAN_REWARD,
    )
    gym.register(
        "pendulum_rl_env/InvertedPendulumRos-v0",
        entry_point="pendulum_rl_env.nodes.ros_env:make_ros_env",
        max_episode_steps=512,
        reward_threshold=SOLVED_MEAN_REWARD,
        nondeterministic=True,
    )
    gym.register(
        "pendulum_rl_env/SamplePendulum-v0",
        entry_point="pendulum_rl_env.sample_pendulum:SamplePendulum",
        max_episode_steps=500,
        reward_threshold=TORQUE_SOLVED_MEAN_REWARD,
    )
