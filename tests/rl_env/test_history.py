"""A policy sees its last samples and actions, the latest first, and no other episode's."""

import gymnasium as gym
import numpy as np
import pytest
from support.hidden_physics import INTECO

from pendulum_rl_env.fleet import Fleet
from pendulum_rl_env.history import HistoryObservation, count_periods, extend_space
from pendulum_rl_env.in_process import make_twin_env
from pendulum_rl_env.task import Task


def test_one_environment_shows_what_was() -> None:
    env, plain = HistoryObservation(make_twin_env(), 2), make_twin_env()
    assert env.observation_space.shape == (17,)
    seen, last = [plain.reset()[0]], env.reset()[0]
    assert np.array_equal(last, [*seen[0], *[*seen[0], 0] * 2])
    for action in (0.5, -0.25, 1.0):
        held = np.array([action], dtype=np.float32)
        seen.append(plain.step(held)[0])
        last = env.step(held)[0]
    assert np.array_equal(last, [*seen[3], *seen[2], 1.0, *seen[1], -0.25])
    assert env.observation_space.contains(last)


def test_sizes_say_how_many_periods() -> None:
    assert [count_periods(size, 5) for size in (5, 11, 17, 12, 4)] == [0, 1, 2, None, None]
    space = extend_space(gym.spaces.Box(-2, 3, (2,), np.float32), 1)
    assert space.low.tolist() == [-2, -2, -2, -2, -1] and space.high.tolist() == [3, 3, 3, 3, 1]


def test_many_pendulums_show_what_each_of_them_saw() -> None:
    pytest.importorskip("stable_baselines3")
    from pendulum_rl_env.learning.fleet_vec_env import FleetVecEnv
    from pendulum_rl_env.learning.history_vec_env import HistoryVecEnv

    task = Task(steps=3)
    plain = FleetVecEnv(Fleet([INTECO], 2, task, spread=1.0, seed=4))
    env = HistoryVecEnv(FleetVecEnv(Fleet([INTECO], 2, task, spread=1.0, seed=4)), 1)
    plain.seed(1), env.seed(1)
    before, shown = plain.reset(), env.reset()
    assert np.array_equal(shown, np.column_stack([before, before, [0, 0]]))
    for k in range(1, 6):
        actions = np.array([[0.1 * k], [-0.2]], dtype=np.float32)
        now, _, dones, infos = plain.step(actions)
        shown, _, _, with_history = env.step(actions)
        past = np.column_stack([before, actions])
        assert dones.all() == (k == 3)
        for i in np.flatnonzero(dones):
            last = infos[i]["terminal_observation"]
            assert np.array_equal(with_history[i]["terminal_observation"], [*last, *past[i]])
            past[i] = [*now[i], 0]  # a new episode remembers nothing
        assert np.array_equal(shown, np.column_stack([now, past]))
        before = now
