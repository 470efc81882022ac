"""Gymnasium environments of the pendulum: in process, over topics, and the thesis's torque pendulum."""

from __future__ import annotations

import gymnasium as gym

gym.register(
    "pendulum_rl_env/InvertedPendulum-v0",
    entry_point="pendulum_rl_env.in_process:make_twin_env",
    vector_entry_point="pendulum_rl_env.in_process:make_twin_vector_env",
    max_episode_steps=512,
    reward_threshold=400,
)
gym.register(
    "pendulum_rl_env/InvertedPendulumRos-v0",
    entry_point="pendulum_rl_env.nodes.ros_env:make_ros_env",
    max_episode_steps=512,
    reward_threshold=400,
    nondeterministic=True,
)
gym.register(
    "pendulum_rl_env/SamplePendulum-v0",
    entry_point="pendulum_rl_env.sample_pendulum:SamplePendulum",
    max_episode_steps=500,
)
