"""The environments under the checks of Gymnasium and stable-baselines3, and their `info`."""

import math
import warnings

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import pendulum_rl_env  # noqa: F401 (registers)
from pendulum_rl_env.env import PendulumEnv
from pendulum_rl_env.noise import MOST_DROPPED_IN_A_ROW, NoiseFilter
from pendulum_rl_env.task import Task
from pendulum_rl_env.transport import Sample
from pendulum_twin.errors import BadInputError

IN_PROCESS = ("pendulum_rl_env/InvertedPendulum-v0", "pendulum_rl_env/SamplePendulum-v0")


@pytest.mark.parametrize("name", IN_PROCESS)
def test_gymnasium_finds_nothing_to_say(name: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)
        check_env(gym.make(name, render_mode=None).unwrapped, skip_render_check=True)


@pytest.mark.parametrize("name", IN_PROCESS)
def test_stable_baselines3_finds_nothing_to_say(name: str) -> None:
    checker = pytest.importorskip("stable_baselines3.common.env_checker")
    with warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)
        checker.check_env(gym.make(name))


def test_actions_from_minus_1_to_1_are_the_whole_pwm() -> None:
    env = gym.make(IN_PROCESS[0])
    assert (env.action_space.low, env.action_space.high) == (-1, 1)
    env.reset(seed=1)
    assert env.step(np.array([1.0], dtype=np.float32))[4]["applied_pwm"] == 0.5
    assert env.unwrapped.action_space.high == np.float32(0.5)


def test_info_tells_the_state_the_end_and_the_time() -> None:
    env = gym.make(IN_PROCESS[0])
    _, info = env.reset()
    assert info["state"] == pytest.approx([0, math.pi, 0, 0]) and info["end"] == "none"
    _, _, terminated, _, info = env.step(np.array([0.0], dtype=np.float32))
    assert not terminated and info["dt_s"] == 0.03 and info["noise_dropped"] == 0
    while not terminated:
        _, reward, terminated, truncated, info = env.step(np.array([0.5], dtype=np.float32))
        assert not truncated
    assert info["end"] == "rail" and reward == -50


def test_any_twin_file_with_any_effects_is_an_environment(tmp_path) -> None:
    from support.hidden_physics import INTECO

    from pendulum_twin.model import Twin, save_twin

    file = tmp_path / "twin.yaml"
    save_twin(
        Twin("mine", INTECO.rig, {"input_sign_inverted": {}, "input_delay": {"delay_s": 0.03}}),
        file,
    )
    env = gym.make(IN_PROCESS[0], twin=str(file))
    env.reset()
    pushed = np.array([1.0], dtype=np.float32)
    assert abs(env.step(pushed)[0][0]) < 1e-9  # late by a period
    assert env.step(pushed)[0][0] < 0.0  # and the other way
    with pytest.raises(BadInputError, match=r"nowhere\.yaml"):
        gym.make(IN_PROCESS[0], twin="nowhere.yaml")


def test_a_picture_shows_the_pole_where_it_is() -> None:
    env = gym.make(IN_PROCESS[0], render_mode="rgb_array")
    env.reset()
    hanging = env.render()
    assert hanging.dtype == np.uint8
    pole = np.argwhere(np.all(hanging == (200, 70, 40), axis=-1))
    assert pole[:, 0].mean() > hanging.shape[0] / 2  # below the rail
    assert abs(pole[:, 1].mean() - hanging.shape[1] / 2) < 2


class ScriptedTransport:
    """A transport that says what it is told to: what a rig with a loose plug would."""

    step_s = 0.03

    def __init__(self, states: list[list[float]], info: dict[str, float] | None = None) -> None:
        self._states, self._info, self._k = states, info or {}, 0

    def reset(self) -> Sample:
        return self._next()

    def exchange(self, command: float) -> Sample:
        return self._next()

    def close(self) -> None:
        pass

    def _next(self) -> Sample:
        state = self._states[min(self._k, len(self._states) - 1)]
        self._k += 1
        return Sample(np.array(state), 0.03 * (self._k - 1), self._info)


def test_a_jump_is_dropped_and_counted_and_the_last_good_sample_stands() -> None:
    hanging, spike = [0.0, math.pi, 0.0, 0.0], [0.5, 0.0, 0.0, 0.0]
    env = PendulumEnv(
        ScriptedTransport([hanging, hanging, spike, hanging, [math.nan] * 4, hanging])
    )
    env.reset()
    dropped, states = [], []
    for _ in range(5):
        _, _, terminated, _, info = env.step(np.zeros(1, dtype=np.float32))
        assert not terminated
        dropped.append(info["noise_dropped"])
        states.append(info["state"])
    assert dropped == [0, 1, 1, 2, 2]
    assert np.array_equal(states, [hanging] * 5)


def test_every_spike_is_dropped_where_good_samples_come_between() -> None:
    hanging, spike = [0.0, math.pi, 0.0, 0.0], [0.5, 0.0, 0.0, 0.0]
    spikes = 2 * MOST_DROPPED_IN_A_ROW
    env = PendulumEnv(ScriptedTransport([hanging, *([spike, hanging] * spikes)]))
    env.reset()
    infos = [env.step(np.zeros(1, dtype=np.float32))[4] for _ in range(2 * spikes)]
    assert infos[-1]["noise_dropped"] == spikes
    assert all(np.array_equal(info["state"], hanging) for info in infos)


@pytest.mark.parametrize(("rig_limit", "most"), [(0.2, 0.2), (0.9, 0.5)])
def test_commands_keep_to_the_smaller_limit_of_task_and_rig(rig_limit: float, most: float) -> None:
    hanging = [0.0, math.pi, 0.0, 0.0]
    env = PendulumEnv(ScriptedTransport([hanging], {"pwm_limit": rig_limit}))
    env.reset()
    sent = [env.step(np.array([pwm]))[4]["applied_pwm"] for pwm in (1.0, -1.0, 0.1)]
    assert sent == [most, -most, 0.1]


def test_a_rig_that_really_is_elsewhere_is_believed_in_the_end() -> None:
    noise, task = NoiseFilter(Task()), Task()
    noise.start(Sample(np.array([0.0, math.pi, 0.0, 0.0]), 0.0))
    far = np.array([0.6, math.pi, 0.0, 0.0])
    believed = [
        noise.select(Sample(far, task.step_s * k)).state[0]
        for k in range(1, MOST_DROPPED_IN_A_ROW + 3)
    ]
    assert believed[-1] == 0.6 and 0 < noise.dropped <= MOST_DROPPED_IN_A_ROW


@pytest.mark.parametrize("dropped", [0, 1, 2])
def test_a_sample_after_noise_may_have_moved_for_as_long_as_has_passed(dropped: int) -> None:
    """Twice what the limits of 3 m/s allow since the last accepted sample, not more."""
    task = Task()
    for share, noisy in ((0.95, 0), (1.05, 1)):
        noise = NoiseFilter(task)
        noise.start(Sample(np.array([0.0, math.pi, 0.0, 0.0]), 0.0))
        for k in range(dropped):
            noise.select(Sample(np.array([9.0, math.pi, 0.0, 0.0]), task.step_s * (k + 1)))
        stamp_s = task.step_s * (dropped + 1)
        moved = np.array([share * 2.0 * 3.0 * stamp_s, math.pi, 0.0, 0.0])
        noise.select(Sample(moved, stamp_s))
        assert noise.dropped == dropped + noisy


def test_the_fastest_motion_within_the_limits_is_no_noise() -> None:
    noise = NoiseFilter(Task())
    noise.start(Sample(np.array([0.0, 0.0, 3.0, 15.0]), 0.0))
    noise.select(Sample(np.array([0.09, 0.45, 2.5, 13.0]), 0.03))
    assert noise.dropped == 0
