"""Train and evaluate on a rig over topics, in real time: the twin stands in for it."""

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import gymnasium as gym
import pytest

pytest.importorskip("rclpy")
pytest.importorskip("stable_baselines3")
from support.paths import CONFIG
from support.served_twin import served_twin

from pendulum_rl_env import evaluate, train
from pendulum_rl_env.learning import environments
from pendulum_rl_env.learning.preset import IN_PROCESS, OVER_TOPICS, load_preset
from pendulum_rl_env.transport import NoAnswerError

TWIN = str(CONFIG / "inteco.yaml")
SHORT = """
pendulum_rl_env/InvertedPendulum-v0:
  {algorithm: ppo, timesteps: 64, environments: 8, layers: [8], learning_rate: 0.001,
   evaluate_every: 64, settings: {n_steps: 32, batch_size: 32, n_epochs: 1}}
"""


@pytest.mark.long
def test_a_policy_is_trained_on_the_rig_and_tried_there(
    ros, monkeypatch, tmp_path: Path, capsys
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", str(ros.domain))
    monkeypatch.setattr(train, "RIG_EVALUATION_EPISODES", 1)
    monkeypatch.setattr("pendulum_rl_env.task.EPISODE_S", 100 * 0.03)  # in real time
    (tmp_path / "short.yaml").write_text(SHORT, encoding="utf-8")
    out = tmp_path / "run"
    with served_twin(ros, "rig", twin=TWIN):
        how = ["--preset", str(tmp_path / "short.yaml"), "--timesteps", "64", "--rig", "rig"]
        assert train.main(["--twin", TWIN, "--out", str(out), *how]) == 0
        result = json.loads((out / "result.json").read_text(encoding="utf-8"))
        assert (
            result["timesteps"] == 64
            and len(result["evaluations"]) == 1
            and result["steps_per_s"] < 40
        )  # 33 by its clock
        capsys.readouterr()
        assert (
            evaluate.main(
                ["--policy", str(out / "policy.zip"), "--rig", "rig", "--episodes", "1", "--json"]
            )
            == 0
        )
        summary = json.loads(capsys.readouterr().out)
        assert summary["episodes"] == 1 and summary["mean_steps"] <= 100
        assert summary["timing"]["worst_delay_s"] >= summary["timing"]["median_delay_s"] > 0.0


@pytest.mark.parametrize("step_s", [0.03, 0.015])
def test_an_episode_on_the_rig_has_as_many_seconds_at_another_sample_time(
    monkeypatch: pytest.MonkeyPatch, step_s: float
) -> None:
    """As in the twin, and where it is evaluated."""
    make = gym.make

    def make_twin_instead(name: str, namespace: str, **arguments: Any) -> gym.Env[Any, Any]:
        assert (name, namespace) == (OVER_TOPICS, "rig")
        return make(IN_PROCESS, **arguments)

    monkeypatch.setattr(environments.gym, "make", make_twin_instead)
    options = SimpleNamespace(rig="rig", twin=None, step_s=step_s)
    training, _ = environments.make_environments(options, load_preset("frugal", IN_PROCESS))
    (env,) = training.envs
    assert env.spec.max_episode_steps == round(512 * 0.03 / step_s)


class FailingRig(gym.Wrapper):
    """A rig that answers so many steps and then stops.

    left: steps that it still answers, shared by all that are made.
    """

    left = 0

    def step(self, action: Any) -> Any:
        """Step the twin that stands in for the rig; raise NoAnswerError when none is left."""
        if FailingRig.left <= 0:
            raise NoAnswerError("/rig: expected a sample, found none")
        FailingRig.left -= 1
        return self.env.step(action)


def stand_in_for_the_rig(monkeypatch: pytest.MonkeyPatch, steps: int) -> None:
    """Let a twin in process stand in for the rig, for so many steps."""
    make = gym.make

    def make_twin_instead(name: str, namespace: str, **arguments: Any) -> gym.Env[Any, Any]:
        return FailingRig(make(IN_PROCESS, **arguments))

    monkeypatch.setattr(FailingRig, "left", steps)
    monkeypatch.setattr(environments.gym, "make", make_twin_instead)
    monkeypatch.setattr("pendulum_rl_env.task.EPISODE_S", 32 * 0.03)
    monkeypatch.setattr(train, "RIG_EVALUATION_EPISODES", 1)


def test_a_rig_that_fails_leaves_what_was_learned(monkeypatch, tmp_path: Path, capsys) -> None:
    (tmp_path / "short.yaml").write_text(SHORT, encoding="utf-8")
    out = tmp_path / "run"
    how = ["--preset", str(tmp_path / "short.yaml"), "--timesteps", "64", "--rig", "rig"]
    stand_in_for_the_rig(monkeypatch, steps=40)  # amid the second rollout
    assert train.main(["--out", str(out), "--quiet", *how]) == 1
    said = capsys.readouterr().err
    assert "train: /rig: expected a sample, found none" in said and "--resume goes on" in said
    assert (out / "policy.zip").is_file() and list(out.glob("checkpoints/policy_*_steps.zip"))
    result = json.loads((out / "result.json").read_text(encoding="utf-8"))
    assert result["timesteps"] == 40 and result["environment"] == OVER_TOPICS
    monkeypatch.setattr(FailingRig, "left", 10_000)
    assert train.main(["--out", str(out), "--resume", *how]) == 0


def test_a_rig_that_fails_at_once_leaves_nothing(monkeypatch, tmp_path: Path) -> None:
    (tmp_path / "short.yaml").write_text(SHORT, encoding="utf-8")
    how = ["--preset", str(tmp_path / "short.yaml"), "--timesteps", "64", "--rig", "rig"]
    stand_in_for_the_rig(monkeypatch, steps=0)
    assert train.main(["--out", str(tmp_path / "run"), *how]) == 1
    assert not (tmp_path / "run" / "policy.zip").exists()


def test_fine_tuning_on_the_rig_evaluates_the_policy_that_it_begins_with(
    monkeypatch, tmp_path: Path
) -> None:
    (tmp_path / "short.yaml").write_text(SHORT, encoding="utf-8")
    how = ["--preset", str(tmp_path / "short.yaml"), "--timesteps", "64", "--rig", "rig"]
    stand_in_for_the_rig(monkeypatch, steps=10_000)
    assert train.main(["--out", str(tmp_path / "first"), *how]) == 0
    init = ["--init", str(tmp_path / "first" / "policy.zip")]
    assert train.main(["--out", str(tmp_path / "second"), *how, *init]) == 0
    first, second = (
        json.loads((tmp_path / name / "result.json").read_text(encoding="utf-8"))
        for name in ("first", "second")
    )
    assert [row["steps"] for row in second["evaluations"]] == [0, 64]
    assert second["evaluations"][0]["mean_reward"] == pytest.approx(first["best_mean_reward"])


def test_a_rig_that_is_not_there_ends_in_a_sentence(
    ros, monkeypatch, tmp_path: Path, capsys
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", str(ros.domain))
    monkeypatch.setattr("pendulum_rl_env.nodes.topic_transport.CONNECT_S", 0.5)
    assert (
        train.main(
            [
                "--out",
                str(tmp_path / "run"),
                "--rig",
                "nobody",
                "--timesteps",
                "64",
                "--preset",
                "fast",
            ]
        )
        == 1
    )
    said = capsys.readouterr().err
    assert said.startswith("train: ") and "nobody" in said and "Traceback" not in said
