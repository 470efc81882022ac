"""The thesis's torque pendulum."""

import math

import gymnasium as gym
import numpy as np
import pytest

import pendulum_rl_env  # noqa: F401 (registers)
from pendulum_rl_env.sample_pendulum import STEP_S, STEPS, TORQUES_N_M, SamplePendulum

NAME = "pendulum_rl_env/SamplePendulum-v0"


def make_pendulum(th: float, w: float) -> SamplePendulum:
    env = SamplePendulum()
    env.reset(seed=0)
    env._th, env._w = th, w
    return env


def test_it_moves_as_gymnasiums_pendulum_with_three_torques() -> None:
    ours, theirs = SamplePendulum(), gym.make("Pendulum-v1").unwrapped
    ours.reset(seed=4)
    theirs.reset(seed=4)
    theirs.state = np.array([ours._th, ours._w])
    random = np.random.default_rng(2)
    for _ in range(300):
        action = int(random.integers(3))
        observation, *_ = ours.step(action)
        expected, *_ = theirs.step(np.array([TORQUES_N_M[action]]))
        assert observation == pytest.approx(expected, abs=1e-5)


def test_the_reward_is_equation_17_of_the_state_that_a_step_leads_to() -> None:
    env = make_pendulum(2.5, -3.0)
    for action in (0, 2, 1, 2, 0) * 40:
        (cos, sin, _), reward, *_ = env.step(action)
        assert reward == pytest.approx(1 - abs(math.atan2(sin, cos) / math.pi), abs=1e-6)
        assert 0.0 <= reward <= 1.0


def test_upright_at_rest_earns_one_and_hanging_nothing() -> None:
    for turns in (0, 1, -2):
        assert make_pendulum(turns * math.tau, 0.0).step(1)[1] == pytest.approx(1.0)
    assert make_pendulum(math.pi, 0.0).step(1)[1] == pytest.approx(0.0, abs=1e-9)


def test_an_episode_is_500_steps_of_25_s_and_390_counts_as_solved() -> None:
    env = gym.make(NAME)
    env.reset(seed=1)
    ends = [env.step(1)[2:4] for _ in range(STEPS)]
    assert ends[-1] == (False, True) and not any(any(end) for end in ends[:-1])
    assert STEPS * STEP_S == 25.0 and env.spec is not None and env.spec.reward_threshold == 390
