"""Train and evaluate as programs of the command line do, small: real learners, real files."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from gymnasium.spaces import Box

pytest.importorskip("stable_baselines3")
from support.paths import CONFIG
from support.polling import until

from pendulum_rl_env import evaluate, train
from pendulum_rl_env.learning.export import INPUT, OUTPUT
from pendulum_rl_env.learning.policies import load_policy, make_policy
from pendulum_rl_env.learning.preset import IN_PROCESS, PRESETS, load_preset
from pendulum_rl_env.task import Task, make_observation
from pendulum_twin.errors import BadInputError

TWIN = str(CONFIG / "inteco.yaml")
SMALL = """
pendulum_rl_env/InvertedPendulum-v0:
  algorithm: {algorithm}
  timesteps: 4096
  environments: {environments}
  layers: [16]
  learning_rate: 0.001
  evaluate_every: 1024
  settings: {settings}
"""
PPO = {
    "algorithm": "ppo",
    "environments": 8,
    "settings": "{n_steps: 64, batch_size: 128, n_epochs: 2}",
}
TQC = {
    "algorithm": "tqc",
    "environments": 1,
    "settings": "{learning_starts: 50, batch_size: 16, buffer_size: 2000}",
}


def write_preset(folder: Path, **how: object) -> str:
    file = folder / "small.yaml"
    file.write_text(SMALL.format(**how), encoding="utf-8")
    return str(file)


def run_training(out: Path, *more: str, how: dict = PPO, steps: int = 2048) -> int:
    small = write_preset(out.parent, **how)
    return train.main(
        [
            "--twin",
            TWIN,
            "--timesteps",
            str(steps),
            "--seed",
            "3",
            "--out",
            str(out),
            "--preset",
            small,
            *more,
        ]
    )


def read_result(out: Path) -> dict:
    return json.loads((out / "result.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def training(tmp_path_factory) -> Path:
    out = tmp_path_factory.mktemp("training") / "run"
    assert run_training(out, steps=6144) == 0
    return out


def test_it_writes_what_the_contract_says(training: Path) -> None:
    result = read_result(training)
    assert result["steps_to_400"] is None and result["wall_to_400_s"] is None
    assert result["best_mean_reward"] == max(row["mean_reward"] for row in result["evaluations"])
    assert (
        len(result["evaluations"]) == 6
        and result["timesteps"] == 6144
        and not result["interrupted"]
    )
    assert result["steps_per_s"] > 0 and result["wall_s"] > 0
    assert (training / "policy.zip").is_file() and list(
        (training / "tensorboard").rglob("events.out.*")
    )
    assert (training / "checkpoints" / "policy_5000_steps.zip").is_file()
    assert (training / "curves.png").read_bytes().startswith(b"\x89PNG")


def test_the_same_seed_learns_the_same_and_another_something_else(tmp_path: Path) -> None:
    for name, seed in (("a", "1"), ("b", "1"), ("c", "2")):
        assert run_training(tmp_path / name, "--seed", seed) == 0
    a, b, c = (load_policy(tmp_path / name / "policy.zip").policy.state_dict() for name in "abc")
    assert all((a[key] == b[key]).all() for key in a) and not all(
        (a[key] == c[key]).all() for key in a
    )


def test_until_stops_at_the_first_evaluation_that_is_good_enough(tmp_path: Path) -> None:
    assert run_training(tmp_path / "run", "--until", "-100", steps=8192) == 0
    assert read_result(tmp_path / "run")["timesteps"] == 1024


@pytest.mark.parametrize("how", [PPO, TQC], ids=["ppo", "tqc"])
def test_it_goes_on_from_the_last_checkpoint(tmp_path: Path, how: dict) -> None:
    steps = 1024 if how is PPO else 300
    assert run_training(tmp_path / "run", how=how, steps=steps) == 0
    assert run_training(tmp_path / "run", "--resume", how=how, steps=2 * steps) == 0
    assert read_result(tmp_path / "run")["timesteps"] == 2 * steps
    assert (tmp_path / "run" / "checkpoints" / f"policy_{2 * steps}_steps.zip").is_file()


def test_a_complete_training_is_not_gone_on_with(training: Path, capsys) -> None:
    before = {path: path.read_bytes() for path in training.rglob("*") if path.is_file()}
    assert run_training(training, "--resume", steps=6000) == 0
    printed = capsys.readouterr().out
    assert "is complete, 6,144 of 6,000 steps: give a larger --timesteps to go on" in printed
    assert before == {path: path.read_bytes() for path in training.rglob("*") if path.is_file()}


def test_training_can_begin_with_a_policy(training: Path, tmp_path: Path) -> None:
    assert run_training(tmp_path / "fine", "--init", str(training / "policy.zip"), steps=512) == 0
    assert (
        run_training(
            tmp_path / "other", "--init", str(training / "policy.zip"), how=TQC, steps=100
        )
        == 1
    )


def test_fine_tuning_explores_by_the_policy_and_not_at_random(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On a rig, too, where `frugal` would drive at random for 1500 steps."""
    assert run_training(tmp_path / "first", how=TQC, steps=60) == 0

    def refuse(space: Box, *_: object) -> None:
        raise AssertionError("a command at random")

    monkeypatch.setattr(Box, "sample", refuse)
    policy = str(tmp_path / "first" / "policy.zip")
    assert run_training(tmp_path / "fine", "--init", policy, how=TQC, steps=60) == 0
    with pytest.raises(AssertionError, match="at random"):
        run_training(tmp_path / "other", how=TQC, steps=60)


@pytest.mark.long
def test_ctrl_c_saves_and_says_how_to_go_on(tmp_path: Path) -> None:
    small, out = write_preset(tmp_path, **PPO), tmp_path / "run"
    command = [
        sys.executable,
        "-m",
        "pendulum_rl_env.train",
        "--twin",
        TWIN,
        "--out",
        str(out),
        "--preset",
        small,
    ]
    program = subprocess.Popen(
        [*command, "--timesteps", "100000000"], stderr=subprocess.PIPE, text=True, env=os.environ
    )
    try:
        until(
            lambda: (out / "result.json").exists() or program.poll() is not None,
            "an evaluation",
        )
        program.send_signal(signal.SIGINT)
        said = program.communicate(timeout=60)[1]
    finally:
        program.kill()
    assert program.returncode == 130 and "--resume goes on" in said and "Traceback" not in said
    assert (
        read_result(out)["interrupted"]
        and (out / "policy.zip").is_file()
        and list(out.glob("checkpoints/*.zip"))
    )


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--twin", "nowhere.yaml"], "nowhere.yaml"),
        (["--init", "nowhere.zip"], "nowhere.zip: expected a policy"),
        (["--preset", "nowhere.yaml"], "--preset: expected fast, frugal, residual, thesis"),
        (["--resume"], "expected checkpoints to go on from"),
        (["--verdict", "nowhere.json"], "nowhere.json: expected a verdict"),
        (["--step-s", "0"], "step_s"),
    ],
)
def test_wrong_input_ends_in_a_sentence(
    tmp_path: Path, capsys, more: list[str], said: str
) -> None:
    assert run_training(tmp_path / "run", *more) == 1
    error = capsys.readouterr().err
    assert said in error and "Traceback" not in error and not (tmp_path / "run").exists()


def test_a_training_is_never_written_over(training: Path, capsys) -> None:
    before = (training / "policy.zip").read_bytes()
    assert run_training(training) == 1
    assert (
        "expected no training there" in capsys.readouterr().err
        and (training / "policy.zip").read_bytes() == before
    )


def test_evaluate_prints_mean_minimum_and_slices(training: Path, capsys, tmp_path: Path) -> None:
    video = tmp_path / "episode.gif"
    policy = ["--policy", str(training / "policy.zip"), "--twin", TWIN, "--episodes", "2"]
    assert evaluate.main([*policy, "--seed", "1", "--json", "--video", str(video)]) == 0
    result = json.loads(capsys.readouterr().out)
    assert (
        result["min_reward"] <= result["mean_reward"]
        and sum(row["episodes"] for row in result["slices"]) == 2
    )
    assert result["mean_reward"] == pytest.approx(
        read_result(training)["best_mean_reward"], abs=0.5
    )
    assert video.read_bytes()[:6] == b"GIF89a"
    assert evaluate.main(policy) == 0
    assert "mean reward" in capsys.readouterr().out


def test_onnx_of_another_task_is_wrong_use(tmp_path: Path, capsys) -> None:
    task = ["--env", "pendulum_rl_env/SamplePendulum-v0", "--out", str(tmp_path / "run")]
    with pytest.raises(SystemExit, match="2"):
        train.main([*task, "--onnx"])
    assert "--onnx: expected the task of" in capsys.readouterr().err


@pytest.mark.parametrize("content", [None, b"", b"not a policy", b"PK\x03\x04 cut short"])
def test_what_is_no_policy_is_refused(tmp_path: Path, capsys, content: bytes | None) -> None:
    file = tmp_path / "policy.zip"
    if content is not None:
        file.write_bytes(content)
    assert evaluate.main(["--policy", str(file), "--twin", TWIN]) == 1
    said = capsys.readouterr().err
    assert "expected a policy" in said and "Traceback" not in said


@pytest.mark.parametrize("how", [PPO, TQC], ids=["ppo", "tqc"])
def test_onnx_gives_the_policys_own_commands_scaling_inside(tmp_path: Path, how: dict) -> None:
    runtime = pytest.importorskip("onnxruntime")
    steps = 1024 if how is PPO else 120
    assert run_training(tmp_path / "run", "--onnx", how=how, steps=steps) == 0
    model, file = (
        load_policy(tmp_path / "run" / "policy.zip"),
        tmp_path / "run" / "policy.onnx",
    )
    states = np.random.default_rng(1).normal(size=(500, 4)) * [0.4, 3.0, 2.0, 9.0]
    commands = runtime.InferenceSession(file).run([OUTPUT], {INPUT: states.astype(np.float32)})[0]
    wanted = 0.5 * make_policy(model)(make_observation(states, Task()))
    assert commands.shape == (500, 1) and commands == pytest.approx(wanted, abs=1e-5)


@pytest.mark.parametrize("name", PRESETS)
@pytest.mark.parametrize("environment", [IN_PROCESS, "pendulum_rl_env/SamplePendulum-v0"])
def test_presets_are_whole(name: str, environment: str) -> None:
    if name == "residual" and environment != IN_PROCESS:
        with pytest.raises(BadInputError, match="expected settings under the key"):
            load_preset(name, environment)  # there is no controller to correct
        return
    assert load_preset(name, environment).timesteps > 0


def test_the_thesis_preset_is_the_thesis() -> None:
    thesis = load_preset("thesis", IN_PROCESS)
    assert (thesis.algorithm, thesis.layers, thesis.learning_rate, thesis.environments) == (
        "ppo",
        (64, 64),
        2.5e-4,
        1,
    )
    assert thesis.settings == {
        "n_steps": 2048,
        "batch_size": 64,
        "n_epochs": 20,
        "gamma": 0.99,
        "gae_lambda": 0.95,
        "ent_coef": 0.0,
        "clip_range": 0.2,
    }


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("algorithm: dreamer", "algorithm"),
        ("learning_rate: 7", "learning_rate"),
        ("colour: red", "colour"),
        ("layers: 3", "layers"),
        ("layers: [0]", "layers"),
        ("layers: [16.5]", "layers: expected a whole number"),
        ("timesteps: 1000.5", "timesteps: expected a whole number"),
        ("environments: 2.5", "environments: expected a whole number"),
        ("evaluate_every: 10.5", "evaluate_every: expected a whole number"),
        ("episode_steps: 10.5", "episode_steps: expected a whole number"),
    ],
)
def test_a_wrong_preset_names_its_key(tmp_path: Path, line: str, said: str) -> None:
    file = tmp_path / "small.yaml"
    key = line.split(":")[0]
    lines = [
        kept for kept in SMALL.format(**PPO).splitlines() if not kept.strip().startswith(f"{key}:")
    ]
    file.write_text("\n".join([*lines, f"  {line}"]), encoding="utf-8")
    with pytest.raises(BadInputError, match=said):
        load_preset(str(file), IN_PROCESS)


def test_a_short_training_learns_something(tmp_path: Path) -> None:
    """Hanging still earns 0; 60,000 steps of the fast preset already swing."""
    out = tmp_path / "run"
    assert (
        train.main(["--twin", TWIN, "--timesteps", "81920", "--seed", "0", "--out", str(out)]) == 0
    )
    assert read_result(out)["best_mean_reward"] > 60
