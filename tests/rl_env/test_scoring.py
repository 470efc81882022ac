"""What an evaluation says is so for any length of a step, and no NaN is scored."""

import gymnasium as gym
import numpy as np
import pytest
from support.paths import CONFIG

import pendulum_rl_env  # noqa: F401
from pendulum_rl_env.noise import MOST_DROPPED_IN_A_ROW, NoiseFilter
from pendulum_rl_env.scoring import Episode, summarise
from pendulum_rl_env.task import Task
from pendulum_rl_env.transport import NoAnswerError, Sample
from pendulum_twin.errors import BadInputError

GOOD = np.array([0.0, np.pi, 0.0, 0.0])


@pytest.mark.parametrize("step_s", [0.01, 0.03, 0.1])
def test_words_go_by_the_reward_a_step(step_s: float) -> None:
    """0.93 a step keeps the pole up, though 154 steps of 0.1 s earn 143 and not 476."""
    steps = Task.make_for_step(step_s).steps
    episode = Episode(0.93 * steps, steps, "none", np.zeros((steps + 1, 4)), np.zeros(steps))
    summary = summarise([episode], steps)
    assert summary["words"] == "keeps the pole up near the middle without sudden moves"
    assert [row["episodes"] for row in summary["slices"]] == [0, 0, 0, 0, 0, 1]
    assert summary["mean_reward"] == pytest.approx(0.93 * steps)


def test_the_delay_of_commands_is_told_where_it_is_known() -> None:
    states, commands = np.zeros((3, 4)), np.zeros(2)
    timing = ({"delay_s": 0.002, "missed": 0.0}, {"delay_s": 0.025, "missed": 1.0})
    summary = summarise([Episode(1.0, 2, "none", states, commands, timing)] * 2)
    assert summary["timing"] == {
        "median_delay_s": pytest.approx(0.0135),
        "worst_delay_s": 0.025,
        "missed": 2,
    }
    in_process = ({"dt_s": 0.03}, {"dt_s": 0.03})
    assert summarise([Episode(1.0, 2, "none", states, commands, in_process)])["timing"] is None


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_state_that_stays_no_number_ends_the_episode(bad: float) -> None:
    noise = NoiseFilter(Task())
    noise.start(Sample(GOOD, 0.0))
    for k in range(MOST_DROPPED_IN_A_ROW):
        assert np.array_equal(noise.select(Sample(np.full(4, bad), 0.03 * k)).state, GOOD)
    with pytest.raises(NoAnswerError, match="expected a state of finite numbers"):
        noise.select(Sample(np.full(4, bad), 1.0))
    with pytest.raises(NoAnswerError):
        NoiseFilter(Task()).start(Sample(np.full(4, bad), 0.0))


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_command_that_is_no_number_is_not_sent(bad: float) -> None:
    env = gym.make("pendulum_rl_env/InvertedPendulum-v0", twin=CONFIG / "inteco.yaml")
    try:
        env.reset(seed=0)
        with pytest.raises(BadInputError, match="expected a finite PWM fraction"):
            env.unwrapped.step(np.array([bad], dtype=np.float32))
    finally:
        env.close()
