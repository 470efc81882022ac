"""A policy says how large its commands are, and every player gives commands of that size.

Over topics: a live twin whose command is in volts, real messages.
"""

import json
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np
import pytest

pytest.importorskip("rclpy")
pytest.importorskip("stable_baselines3")
import torch
from std_msgs.msg import Float64
from support.ros_graph import Graph
from support.served_twin import served_twin

from pendulum_rl_env import evaluate, train
from pendulum_rl_env.command_limits import check_limits
from pendulum_rl_env.in_process import make_twin_env
from pendulum_rl_env.learning.policies import (
    get_task,
    load_controller,
    load_policy,
    prepare_env,
    save_policy,
)
from pendulum_rl_env.learning.policy_file import FACTS, WEIGHTS
from pendulum_rl_env.task import Task
from pendulum_twin.errors import BadInputError
from pendulum_twin.inteco import INTECO
from pendulum_twin.model import Twin, save_twin

VOLTS = 6.0
PUSH = 0.8  # of the limit: what the made policy commands, wherever the pendulum is
STEP_S = 0.05
HANGING = np.array([0.0, np.pi, 0.0, 0.0])
SHORT = """
pendulum_rl_env/InvertedPendulum-v0:
  {algorithm: ppo, timesteps: 64, environments: 8, layers: [8], learning_rate: 0.0000001,
   evaluate_every: 64, settings: {n_steps: 32, batch_size: 32, n_epochs: 1}}
"""
ALL_OF_THEM = 100_000  # samples that wait while a program runs in the test's own thread
Samples = list[tuple[int, float]]  # when a command was sent on, in ns, and the command
ANOTHER_UNIT = "expected a rig that takes commands up to"


def make_twin(limit: float | None) -> Twin:
    """Return the INTECO rig with another unit of its command: as much force at the limit."""
    rig = INTECO.rig
    force = rig.force_per_pwm_n * rig.pwm_limit / (limit or VOLTS)
    return Twin(f"limit_{limit}", replace(rig, force_per_pwm_n=force, pwm_limit=limit))


@pytest.fixture(scope="module")
def files(tmp_path_factory) -> Path:
    """Return a folder of twin files, a preset and what `train` has learned in volts."""
    folder = tmp_path_factory.mktemp("limits")
    for limit in (0.5, 3.0, VOLTS, 12.0, None):
        save_twin(make_twin(limit), folder / f"twin_{limit}.yaml")
    (folder / "short.yaml").write_text(SHORT, encoding="utf-8")
    twin, out = str(folder / f"twin_{VOLTS}.yaml"), str(folder / "run")
    how = ["--preset", str(folder / "short.yaml"), "--step-s", str(STEP_S), "--onnx"]
    assert train.main(["--twin", twin, "--out", out, *how]) == 0
    return folder


@pytest.fixture(scope="module")
def policy(files: Path) -> Path:
    """Return the learned policy, changed to push one way with most of its limit."""
    model = load_policy(files / "run" / "policy.zip")
    layer: Any = model.policy.action_net
    with torch.no_grad():
        layer.weight.zero_()
        layer.bias.fill_(PUSH)
    save_policy(model, files / "policy.zip")
    return files / "policy.zip"


def change_facts(policy: Path, out: Path, change: Callable[[dict], object]) -> Path:
    """Write a policy file with other facts."""
    with ZipFile(policy) as archive:
        facts, weights = json.loads(archive.read(FACTS)), archive.read(WEIGHTS)
    change(facts)
    with ZipFile(out, "w") as archive:
        archive.writestr(FACTS, json.dumps(facts))
        archive.writestr(WEIGHTS, weights)
    return out


@pytest.fixture(scope="module")
def old_policy(files: Path, policy: Path) -> Path:
    """Return the policy as a file from before files said what they were trained for."""
    return change_facts(policy, files / "old.zip", lambda facts: facts.pop("task"))


@pytest.fixture
def short_episodes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pendulum_rl_env.task.EPISODE_S", 0.5)


@contextmanager
def listen(ros: Graph, monkeypatch: pytest.MonkeyPatch, twin: Path) -> Iterator[Samples]:
    """Serve a twin in real time as the rig, and give what it has applied so far."""
    monkeypatch.setenv("ROS_DOMAIN_ID", str(ros.domain))
    applied: Samples = []
    with served_twin(ros, "rig", twin=str(twin)):
        node = ros.user()

        def note(message: Float64, info: dict[str, int]) -> None:
            applied.append((info["source_timestamp"], message.data))

        node.create_subscription(Float64, "/rig/applied_pwm", note, ALL_OF_THEM)
        ros.until(lambda: applied, "the twin")
        yield applied


def play(policy: Path, *where: str) -> int:
    return evaluate.main(["--policy", str(policy), "--episodes", "1", "--json", *where])


def collect(ros: Graph, applied: Samples) -> float:
    """Return the largest command that was applied; the last episode is over."""
    end_ns = time.time_ns()
    ros.until(lambda: applied[-1][0] > end_ns, "the rest")
    return max(abs(command) for _, command in applied)


def test_a_policy_file_says_its_limit_and_its_sample_time(policy: Path, old_policy: Path) -> None:
    with ZipFile(policy) as archive:
        assert json.loads(archive.read(FACTS))["task"] == {"pwm_limit": VOLTS, "step_s": STEP_S}
    task = get_task(load_policy(policy))
    assert task == replace(Task.make_for_step(STEP_S), pwm_limit=VOLTS)
    assert get_task(load_policy(old_policy)) is None


@pytest.mark.parametrize(
    "task",
    [{"pwm_limit": -1.0, "step_s": 0.03}, {"pwm_limit": 6.0, "step_s": 9.0}, {"step_s": 0.03}, 3],
)
def test_a_damaged_limit_is_refused(tmp_path: Path, policy: Path, task: object) -> None:
    damaged = change_facts(policy, tmp_path / "p.zip", lambda facts: facts.update(task=task))
    with pytest.raises(BadInputError, match="expected a policy that `train` has written"):
        load_policy(damaged)


@pytest.mark.usefixtures("short_episodes")
def test_over_topics_commands_are_as_large_as_the_policy_learned_them(
    ros: Graph, monkeypatch: pytest.MonkeyPatch, files: Path, policy: Path, capsys
) -> None:
    with listen(ros, monkeypatch, files / f"twin_{VOLTS}.yaml") as applied:
        assert play(policy, "--rig", "rig") == 0
        assert collect(ros, applied) == pytest.approx(PUSH * VOLTS, rel=1e-6)
    printed = capsys.readouterr()
    assert json.loads(printed.out)["mean_steps"] <= 0.5 / STEP_S  # of its sample time
    assert "clipped" not in printed.err


@pytest.mark.usefixtures("short_episodes")
def test_over_topics_a_file_that_says_no_limit_plays_as_before(
    ros: Graph, monkeypatch: pytest.MonkeyPatch, files: Path, old_policy: Path
) -> None:
    with listen(ros, monkeypatch, files / f"twin_{VOLTS}.yaml") as applied:
        assert play(old_policy, "--rig", "rig") == 0
        assert collect(ros, applied) == pytest.approx(PUSH * 0.5, rel=1e-6)


@pytest.mark.usefixtures("short_episodes")
def test_over_topics_a_smaller_limit_clips_and_says_so(
    ros: Graph, monkeypatch: pytest.MonkeyPatch, files: Path, policy: Path, capsys
) -> None:
    with listen(ros, monkeypatch, files / "twin_3.0.yaml") as applied:
        assert play(policy, "--rig", "rig") == 0
        assert collect(ros, applied) == 3.0
    assert (
        "/rig takes commands up to 3: larger commands of the policy, up to 6, are clipped"
        in capsys.readouterr().err
    )


@pytest.mark.usefixtures("short_episodes")
def test_over_topics_another_unit_is_refused_before_the_first_command(
    ros: Graph, monkeypatch: pytest.MonkeyPatch, files: Path, policy: Path, capsys
) -> None:
    with listen(ros, monkeypatch, files / "twin_0.5.yaml") as applied:
        assert play(policy, "--rig", "rig") == 1
        assert collect(ros, applied) == 0.0
    said = capsys.readouterr().err
    assert f"/rig: {ANOTHER_UNIT} 6, found" in said and "Traceback" not in said


@pytest.mark.usefixtures("short_episodes")
def test_a_policy_is_fine_tuned_over_topics_with_its_own_limit(
    ros: Graph, monkeypatch: pytest.MonkeyPatch, files: Path, policy: Path, tmp_path: Path
) -> None:
    monkeypatch.setattr(train, "RIG_EVALUATION_EPISODES", 1)
    how = ["--preset", str(files / "short.yaml"), "--timesteps", "64", "--rig", "rig"]
    with listen(ros, monkeypatch, files / f"twin_{VOLTS}.yaml") as applied:
        assert train.main([*how, "--init", str(policy), "--out", str(tmp_path / "tuned")]) == 0
        assert collect(ros, applied) > 0.5
    assert get_task(load_policy(tmp_path / "tuned" / "policy.zip")) == get_task(
        load_policy(policy)
    )


@pytest.mark.usefixtures("short_episodes")
@pytest.mark.parametrize(
    ("limit", "largest", "said"),
    [(VOLTS, PUSH * VOLTS, ""), (12.0, PUSH * VOLTS, ""), (None, PUSH * VOLTS, ""),
     (3.0, 3.0, "limit_3.0 takes commands up to 3"), (0.5, None, f"limit_0.5: {ANOTHER_UNIT} 6")],
)  # fmt: skip
def test_in_process_the_policys_limit_holds_too(
    files: Path,
    policy: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys,
    limit: float | None,
    largest: float | None,
    said: str,
) -> None:
    held = []
    advance = "pendulum_rl_env.kernel_transport.lanes.advance_lanes_from_python"

    def note(code: Any, kinds: Any, lanes: Any, timing: Any, commands: Any) -> None:
        held.append(float(commands[0]))

    monkeypatch.setattr(advance, note)
    status = play(policy, "--twin", str(files / f"twin_{limit}.yaml"))
    printed = capsys.readouterr().err
    assert status == (1 if largest is None else 0)
    assert said in printed if said else "takes commands" not in printed
    if largest is not None:
        assert max(held) == pytest.approx(largest, rel=1e-6)


def test_another_sample_time_can_be_asked_for(policy: Path, files: Path, capsys) -> None:
    twin = str(files / f"twin_{VOLTS}.yaml")
    assert play(policy, "--twin", twin, "--step-s", "0.03") == 0
    quick = json.loads(capsys.readouterr().out)["mean_steps"]
    assert play(policy, "--twin", twin) == 0
    assert json.loads(capsys.readouterr().out)["mean_steps"] < quick


def test_training_goes_on_with_the_limit_of_the_policy(
    files: Path, policy: Path, tmp_path: Path
) -> None:
    how = ["--preset", str(files / "short.yaml"), "--timesteps", "64", "--init", str(policy)]
    twin = ["--twin", str(files / "twin_12.0.yaml")]
    assert train.main([*how, *twin, "--out", str(tmp_path / "tuned")]) == 0
    task = get_task(load_policy(tmp_path / "tuned" / "policy.zip"))
    assert task is not None and (task.pwm_limit, task.step_s) == (VOLTS, STEP_S)


def test_a_policy_as_a_controller_and_as_onnx_gives_its_own_unit(
    policy: Path, old_policy: Path, files: Path
) -> None:
    assert load_controller(policy, Task())(HANGING) == pytest.approx(PUSH * VOLTS, rel=1e-6)
    assert load_controller(old_policy, Task())(HANGING) == pytest.approx(PUSH * 0.5, rel=1e-6)
    runtime = pytest.importorskip("onnxruntime")
    session = runtime.InferenceSession(files / "run" / "policy.onnx")
    given = session.run(["pwm"], {"state": HANGING[None].astype(np.float32)})[0]
    learned = load_controller(files / "run" / "policy.zip", Task())
    assert float(given[0, 0]) == pytest.approx(learned(HANGING), abs=1e-4)


def test_an_environment_of_another_limit_is_no_place_for_the_policy(policy: Path) -> None:
    with pytest.raises(BadInputError, match="expected an environment whose commands go up to 6"):
        prepare_env(make_twin_env(INTECO, step_s=STEP_S), load_policy(policy))


@pytest.mark.parametrize(
    ("policy_limit", "rig_limit", "clips"),
    [(0.5, None, False), (0.5, float("inf"), False), (0.5, 0.5, False), (0.5, 0.3, True),
     (0.5, 1.0, False), (6.0, 12.0, False), (6.0, 5.0, True)],
)  # fmt: skip
def test_limits_of_one_unit_are_compared(
    policy_limit: float, rig_limit: float | None, clips: bool, capsys
) -> None:
    check_limits(policy_limit, rig_limit, "rig")
    assert ("clipped" in capsys.readouterr().err) == clips


@pytest.mark.parametrize(("policy_limit", "rig_limit"), [(0.5, 6.0), (6.0, 0.5), (6.0, 1.0)])
def test_limits_of_two_units_contradict(policy_limit: float, rig_limit: float) -> None:
    with pytest.raises(BadInputError, match="train in a twin of this rig"):
        check_limits(policy_limit, rig_limit, "rig")
