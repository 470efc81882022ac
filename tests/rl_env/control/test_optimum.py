"""Plans are differentiated and improved on the kernel, and replayed by the environment."""

import json

import numpy as np
import pytest
from support.hidden_physics import INTECO

from pendulum_rl_env.control.classical import make_plant
from pendulum_rl_env.control.optimum import find_optimum
from pendulum_rl_env.control.rollouts import STEP_SHARES, TwinRunner
from pendulum_rl_env.control.smooth_reward import compute_smooth_reward
from pendulum_rl_env.control.trajectory import sum_rewards
from pendulum_rl_env.optimum_file import read_best_reward
from pendulum_rl_env.reward import compute_reward
from pendulum_rl_env.studies import optimum as study
from pendulum_rl_env.studies.optimum import replay_commands
from pendulum_rl_env.task import Task
from pendulum_twin.errors import BadInputError
from pendulum_twin.laws.law import Law
from pendulum_twin.model import Twin

TASK = Task(steps=90)
LATE = Twin("late", INTECO.rig, {"input_delay": {"delay_s": 0.045}, "angle_scale": {"ratio": 1.1}})
RNG = np.random.default_rng(3)


def test_the_smooth_reward_is_the_reward_and_its_derivatives_are_its_own() -> None:
    states = RNG.uniform(-1, 1, (50, 4)) * [0.6, 6.0, 2.5, 12.0]
    exact = [compute_reward(state, TASK) for state in states]
    assert compute_smooth_reward(states, TASK, 1e-6)[0] == pytest.approx(exact, abs=1e-5)
    states[0, 0], states[1, 3] = 0.69, -14.9  # where the penalties grow
    _, gradient, hessian = compute_smooth_reward(states, TASK, 1.0)
    for k, aside in enumerate(1e-5 * np.eye(4)):
        plus, minus = (compute_smooth_reward(states + s * aside, TASK, 1.0) for s in (1, -1))
        assert gradient[:, k] == pytest.approx((plus[0] - minus[0]) / 2e-5, rel=1e-4, abs=1e-6)
        assert hessian[:, k] == pytest.approx((plus[1] - minus[1]) / 2e-5, rel=1e-3, abs=1e-4)


@pytest.mark.parametrize(("twin", "remembered"), [(INTECO, 0), (LATE, 2)])
def test_derivatives_say_what_a_small_change_of_plan_does(twin: Twin, remembered: int) -> None:
    runner = TwinRunner(twin, 0.03, 0.5)
    commands = 0.3 * np.sin(np.arange(12.0))
    run = runner.run(commands, runner.hang())
    slopes = runner.differentiate(run, remembered)
    change = 1e-3 * RNG.normal(size=12)
    away = runner.run(commands + change, runner.hang()).true - run.true
    expected = np.zeros(4)
    for k in range(12):
        expected = slopes.state[k] @ expected
        for j in range(min(remembered, k) + 1):
            expected = expected + slopes.command[k, j] * change[k - j]
        assert away[k + 1] == pytest.approx(expected, rel=2e-2, abs=2e-5)


@pytest.mark.parametrize(
    "twin",
    [
        Twin(
            "slow", INTECO.rig, {"cart_presliding_friction": {"level_n": 0.5, "distance_m": 0.02}}
        ),
        Twin(
            "cable",
            INTECO.rig,
            measured_laws={"cart_hysteresis": Law((0.01, 0.02, 0.04), (0.0, 0.2, 0.3))},
        ),
    ],
    ids=lambda twin: twin.name,
)
def test_a_run_from_a_snapshot_goes_on_with_what_its_path_left(twin: Twin) -> None:
    runner = TwinRunner(twin, 0.03, 0.5)
    commands = 0.3 * np.sin(0.5 * np.arange(40.0))
    whole = runner.run(commands, runner.hang())
    rest = runner.run(commands[25:], whole.make_snapshot(25))
    np.testing.assert_array_equal(rest.true, whole.true[25:])


def test_feedback_counts_past_commands_and_the_limit() -> None:
    runner = TwinRunner(LATE, 0.03, 0.5)
    commands, way = np.zeros(5), np.array([0.1, 0.0, 0.0, 0.0, 1.0])
    gains = np.zeros((5, 6))
    gains[1, 4], gains[2, 5] = 2.0, 3.0
    start = runner.hang()
    runs = runner.follow(commands, np.tile(start.true, (5, 1)), way, gains, start)
    for share, run in zip(STEP_SHARES, runs, strict=True):
        past = [0.1 * share, 0.2 * share, 0.3 * share]
        assert run.commands == pytest.approx([*past, 0.0, min(share, 0.5)])


def test_a_part_of_a_run_goes_on_from_its_snapshot() -> None:
    runner = TwinRunner(LATE, 0.03, 0.5)
    run = runner.run(0.3 * np.sin(np.arange(12.0)), runner.hang())
    rest = runner.run(run.commands[5:], run.make_snapshot(5))
    assert np.array_equal(rest.true, run.true[5:])
    assert np.array_equal(rest.shown, run.shown[5:])


@pytest.mark.parametrize("twin", [INTECO, LATE], ids=lambda twin: twin.name)
def test_the_environment_pays_for_the_plan_what_was_promised(twin: Twin) -> None:
    optimum = find_optimum(make_plant(twin, TASK), starts=1)
    assert optimum.reward > optimum.starts[0] + 1 and optimum.agreeing == 1
    episode = replay_commands(twin, optimum.run.commands, TASK)
    assert episode.reward == pytest.approx(optimum.reward, abs=1e-9) and episode.end == "none"
    assert np.array_equal(episode.states, optimum.run.shown)
    assert np.abs(episode.commands).max() <= 0.5 and np.abs(episode.states[:, 0]).max() < 0.7
    # nothing small is left to gain: no single command can be better
    runner = TwinRunner(twin, TASK.step_s, TASK.pwm_limit)
    for k in (5, 20, 40):
        for change in (-0.02, 0.02):
            other = optimum.run.commands.copy()
            other[k] = np.clip(other[k] + change, -0.5, 0.5)
            run = runner.run(other, runner.hang())
            assert sum_rewards(run, TASK) < optimum.reward + 0.02


def test_the_command_writes_what_evaluate_reads(tmp_path, capsys, monkeypatch) -> None:
    monkeypatch.setattr(study.Task, "make_for_step", lambda step_s: Task(step_s, 60))
    file = tmp_path / "optimum.json"
    assert study.main(["--starts", "1", "--out", str(file)]) == 0
    said = capsys.readouterr().out
    assert "the environment pays" in said and "1 of 1 starts end there" in said
    content = json.loads(file.read_text(encoding="utf-8"))
    assert read_best_reward(file, 60) == content["reward"] > 0
    assert len(content["commands"]) == 60 and len(content["states"]) == 61
    with pytest.raises(BadInputError, match="expected the optimum of episodes of 512 steps"):
        read_best_reward(file, 512)
    file.write_text(json.dumps({**content, "reward": "much"}), encoding="utf-8")
    with pytest.raises(BadInputError, match="expected a positive reward, found 'much'"):
        read_best_reward(file, 60)


def test_wrong_input_ends_in_a_sentence(capsys, tmp_path) -> None:
    assert study.main(["--twin", "nowhere.yaml"]) == 1
    assert "nowhere.yaml" in capsys.readouterr().err
    assert study.main(["--video", str(tmp_path / "episode.avi")]) == 1
    assert "ends in .mp4 or .gif" in capsys.readouterr().err
