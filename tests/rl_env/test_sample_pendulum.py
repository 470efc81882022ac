"""The thesis's torque pendulum."""

import math

import gymnasium as gym
import numpy as np
import pytest

import pendulum_rl_env  # noqa: F401 (registers)
from pendulum_rl_env.sample_pendulum import STEPS, TORQUES_N_M, SamplePendulum


def put(th: float, w: float) -> SamplePendulum:
    env = SamplePendulum()
    env.reset(seed=0)
    env._th, env._w = th, w
    return env


def test_it_is_gymnasiums_pendulum_with_three_torques() -> None:
    ours, theirs = SamplePendulum(), gym.make("Pendulum-v1").unwrapped
    ours.reset(seed=4)
    theirs.reset(seed=4)
    theirs.state = np.array([ours._th, ours._w])
    random = np.random.default_rng(2)
    for _ in range(300):
        action = int(random.integers(3))
        seen, reward, *_ = ours.step(action)
        wanted, cost, *_ = theirs.step(np.array([TORQUES_N_M[action]]))
        assert reward == pytest.approx(cost, abs=1e-9) and seen == pytest.approx(wanted, abs=1e-5)


def test_upright_at_rest_without_torque_costs_nothing() -> None:
    assert put(0.0, 0.0).step(1)[1] == 0.0
    assert put(math.pi, 0.0).step(1)[1] == pytest.approx(-(math.pi**2))


def test_an_episode_is_500_steps() -> None:
    env = gym.make("pendulum_rl_env/SamplePendulum-v0")
    env.reset(seed=1)
    ends = [env.step(1)[2:4] for _ in range(STEPS)]
    assert ends[-1] == (False, True) and not any(any(end) for end in ends[:-1])
