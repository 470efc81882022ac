"""The task's numbers, its ends and its reward, against equation 27 written out again."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pendulum_rl_env.reward import compute_reward
from pendulum_rl_env.task import End, Task, find_end, make_observation
from pendulum_twin.errors import BadInputError

TASK = Task()
INSIDE = st.tuples(
    st.floats(-0.7, 0.7), st.floats(-50, 50), st.floats(-3, 3), st.floats(-15, 15)
)  # x, th, v, w within the limits


def state(x: float = 0.0, th: float = 0.0, v: float = 0.0, w: float = 0.0) -> np.ndarray:
    return np.array([x, th, v, w])


def test_upright_at_rest_in_the_middle_earns_one_and_hanging_nothing() -> None:
    assert compute_reward(state(), TASK) == pytest.approx(1.0)
    assert compute_reward(state(th=2 * math.pi), TASK) == pytest.approx(1.0)
    assert compute_reward(state(th=math.pi), TASK) == pytest.approx(0.0, abs=1e-12)


@given(INSIDE)
def test_it_is_equation_27_and_between_0_and_1(values: tuple[float, float, float, float]) -> None:
    x, th, v, w = values
    a = math.atan2(math.sin(th), math.cos(th))
    expected = (
        (1 - abs(a / math.pi))
        * (15 - abs(w))
        / 15
        * (0.75 * (0.7 - abs(x)) / 0.7 + 0.25 * (3 - abs(v)) / 3)
    )
    assert compute_reward(np.array(values), TASK) == pytest.approx(expected, abs=1e-9)
    assert -1e-12 <= compute_reward(np.array(values), TASK) <= 1


@pytest.mark.parametrize(
    ("where", "end", "reward"),
    [
        ({"x": 0.71}, End.RAIL, -50),
        ({"x": -0.71}, End.RAIL, -50),
        ({"v": 3.1}, End.CART_SPEED, -30),
        ({"w": -15.1}, End.POLE_SPEED, -30),
        ({"x": 0.8, "v": 9, "w": 99}, End.RAIL, -50),
        ({"x": math.nan}, End.RAIL, -50),
        ({"v": math.nan}, End.CART_SPEED, -30),
        ({"w": math.inf}, End.POLE_SPEED, -30),
        ({"w": math.nan}, End.POLE_SPEED, -30),
        ({"x": 0.7, "v": -3, "w": 15}, End.NONE, 0.0),
    ],
)
def test_an_episode_ends_beyond_the_limits_and_its_penalty_is_given(
    where: dict[str, float], end: End, reward: float
) -> None:
    assert find_end(state(**where), TASK) is end
    assert compute_reward(state(**where), TASK) == pytest.approx(reward, abs=1e-12)


def test_the_observation_is_what_the_thesis_lists() -> None:
    seen = make_observation(np.array([0.1, 3.0, 0.2, -4.0]), TASK)
    assert seen.dtype == np.float32
    assert seen == pytest.approx([0.1, 0.2, math.sin(3.0), math.cos(3.0), -4.0], abs=1e-6)
    far = make_observation(np.array([[99.0, 0.0, -99.0, 999.0]]), TASK)
    assert np.all(np.abs(far) <= TASK.bounds)


@pytest.mark.parametrize(
    "wrong", [{"step_s": 0.0}, {"steps": 0}, {"x_limit_m": -1.0}, {"pwm_limit": math.nan}]
)
def test_a_number_that_cannot_be_is_named(wrong: dict[str, float]) -> None:
    with pytest.raises(BadInputError, match=next(iter(wrong))):
        Task(**wrong)


def test_another_sample_time_keeps_the_seconds() -> None:
    assert Task.make_for_step(0.03) == Task() and Task.make_for_step(0.01).steps == 1536
