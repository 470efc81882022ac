"""Many pendulums in one compiled call: the same episodes as one environment at a time."""

import math

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from support.hidden_physics import HIDDEN, INTECO

import pendulum_rl_env  # noqa: F401 (registers)
from pendulum_rl_env.env import PendulumEnv
from pendulum_rl_env.fleet import SPREAD_RANGE, Fleet
from pendulum_rl_env.in_process import make_twin_env, make_twin_vector_env
from pendulum_rl_env.kernel_transport import KernelTransport
from pendulum_rl_env.task import End, Task
from pendulum_rl_env.vector_env import PendulumVectorEnv
from pendulum_twin.encoders import Encoders
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin

COARSE = Encoders(57e-6, 2 * math.pi / 4096)


@pytest.mark.parametrize(
    "effect", [None, "input_delay", "cart_coulomb_friction", "velocity_filter", "gain_drift"]
)
def test_a_fleet_is_many_single_environments(effect: str | None) -> None:
    twin = Twin("rig", INTECO.rig, {effect: HIDDEN[effect]} if effect else {})
    fleet = Fleet([twin], 3, encoders=COARSE)
    env = gym.wrappers.TimeLimit(PendulumEnv(KernelTransport(twin, 0.03, COARSE)), 512)
    random = np.random.default_rng(5)
    seen, _ = env.reset()
    assert np.array_equal(fleet.course.seen[1], seen)
    total, ends = 0.0, 0
    for _ in range(700):
        command = random.uniform(-0.5, 0.5)
        course = fleet.step(np.full(3, command))
        seen, reward, terminated, truncated, info = env.step(np.array([command]))
        total += reward
        assert np.array_equal(course.last[1], seen) and course.reward[1] == reward
        assert (
            End(course.end[1]).name.lower() == info["end"]
            and bool(course.truncated[1]) == truncated
        )
        if terminated or truncated:
            assert course.total[1] == pytest.approx(total)
            seen, _ = env.reset()
            total, ends = 0.0, ends + 1
            assert np.array_equal(course.seen[1], seen)
    assert ends >= 1


def test_an_episode_lasts_512_steps_and_is_then_cut_not_ended() -> None:
    fleet = Fleet([INTECO], 2)
    for _ in range(511):
        course = fleet.step(np.zeros(2))
        assert not course.truncated.any()
    course = fleet.step(np.zeros(2))
    assert course.truncated.all() and (course.end == 0).all() and (course.length == 512).all()


def test_at_the_rail_the_penalty_is_what_the_agent_gets() -> None:
    fleet = Fleet([INTECO], 1)
    rewards = []
    while not (course := fleet.step(np.array([0.25]))).end[0]:
        rewards.append(float(course.reward[0]))
        assert len(rewards) < 200
    assert course.end[0] == End.RAIL and course.reward[0] == -50.0
    assert course.total[0] == pytest.approx(sum(rewards) - 50)
    assert course.seen[0] == pytest.approx([0, 0, 0, -1, 0], abs=1e-6)


def test_an_end_at_the_last_step_is_no_cut() -> None:
    """Learners add what would have come after a cut, and nothing after an end."""
    pushed = np.array([0.5])
    fleet = Fleet([INTECO], 1)
    while not fleet.step(pushed).end[0]:
        assert fleet.course.length[0] < 200
    steps = int(fleet.course.length[0])
    short = Fleet([INTECO], 1, Task(steps=steps))
    for _ in range(steps):
        course = short.step(pushed)
    assert course.length[0] == steps and course.end[0] == End.CART_SPEED
    assert not course.truncated[0]


def test_the_same_seed_gives_the_same_episodes_and_another_others() -> None:
    def play(seed: int) -> np.ndarray:
        fleet = Fleet(
            [INTECO, Twin("b", INTECO.rig, {"rail_tilt": {"angle_rad": 0.05}})],
            16,
            spread=0.5,
            seed=seed,
        )
        random = np.random.default_rng(1)
        return np.array(
            [fleet.step(random.uniform(-0.5, 0.5, 16)).seen.copy() for _ in range(200)]
        )

    assert np.array_equal(play(4), play(4)) and not np.array_equal(play(4), play(5))


def test_starts_spread_as_far_as_they_are_told_and_twins_take_turns() -> None:
    heavy = Twin("heavy", INTECO.rig, {"angle_offset": {"angle_rad": 0.1}})
    fleet = Fleet([INTECO, heavy], 4000, spread=0.25, seed=1)
    x = fleet.course.seen[:, 0]
    hanging = x == 0
    assert np.mean(hanging) == pytest.approx(0.75, abs=0.03)
    assert 0.9 * SPREAD_RANGE[0] < np.abs(x).max() <= SPREAD_RANGE[0]
    offset = np.isclose(
        fleet.course.seen[hanging, 2], np.sin(np.pi + 0.1), atol=1e-6
    )  # it hangs by its weight all the same
    assert np.mean(offset) == pytest.approx(0.5, abs=0.03)
    assert fleet.course.seen[hanging][~offset, 3] == pytest.approx(-1, abs=1e-6)


def test_pwm_is_held_within_the_limit_of_task_and_rig() -> None:
    first, second = Fleet([INTECO], 1), Fleet([INTECO], 1)
    for _ in range(20):
        assert np.array_equal(first.step(np.array([7.0])).last, second.step(np.array([0.5])).last)


def test_the_vector_environment_keeps_gymnasiums_contract() -> None:
    env = gym.make_vec("pendulum_rl_env/InvertedPendulum-v0", num_envs=5)
    assert (
        isinstance(env, PendulumVectorEnv)
        and env.metadata["autoreset_mode"] is AutoresetMode.SAME_STEP
    )
    seen, _ = env.reset(seed=3)
    assert env.observation_space.contains(seen) and env.action_space.shape == (5, 1)
    for _ in range(300):
        seen, reward, terminated, truncated, info = env.step(
            np.full((5, 1), 0.5, dtype=np.float32)
        )
        assert env.observation_space.contains(
            seen
        ) and reward.shape == terminated.shape == truncated.shape == (5,)
        if terminated.any():
            break
    assert terminated.all() and info["final_obs"][0, 0] > 0.7 and seen[0, 0] == 0
    assert info["final_info"]["episode"]["r"][0] < 0 and info["final_info"]["end"][0] == End.RAIL


ID = "pendulum_rl_env/InvertedPendulum-v0"


@pytest.mark.parametrize(
    ("arguments", "error", "said"),
    [
        ({"stepp_s": 0.02}, TypeError, "stepp_s"),
        ({"pwm_limit": 6.0}, BadInputError, "expected a rig that takes commands up to 6"),
        ({"max_episode_steps": 0}, BadInputError, "steps: expected a number from 1"),
        ({"render_mode": "rgb_array"}, BadInputError, "render_mode: expected None .*'rgb_array'"),
    ],
)
def test_arguments_that_it_does_not_have_are_refused(
    arguments: dict, error: type[Exception], said: str
) -> None:
    with pytest.raises(error, match=said):
        gym.make_vec(ID, num_envs=2, **arguments)


@pytest.mark.long
def test_its_arguments_are_heeded() -> None:
    env = gym.make_vec(ID, num_envs=2, pwm_limit=0.25, max_episode_steps=7, render_mode=None)
    env.reset(seed=1)
    still, full = np.zeros((2, 1), dtype=np.float32), np.ones((2, 1), dtype=np.float32)
    quarter = Fleet([INTECO], 1)
    assert env.step(full)[0][0] == pytest.approx(quarter.step(np.array([0.25])).seen[0])
    assert [bool(env.step(still)[3].any()) for _ in range(7)] == [*[False] * 5, True, False]


@pytest.mark.parametrize("step_s", [0.03, 0.015])
def test_an_episode_has_as_many_seconds_at_another_sample_time(step_s: float) -> None:
    env = make_twin_vector_env(2, step_s=step_s)
    assert env.fleet.task == Task.make_for_step(step_s)
    assert make_twin_env(step_s=step_s).unwrapped.task == Task.make_for_step(step_s)


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_an_action_that_is_no_number_is_the_policy_s_fault(wrong: float) -> None:
    env = gym.make_vec(ID, num_envs=2)
    env.reset(seed=1)
    with pytest.raises(BadInputError, match=f"found {wrong}: the policy is broken"):
        env.step(np.array([[0.1], [wrong]], dtype=np.float32))
