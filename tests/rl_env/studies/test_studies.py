"""From a concealed rig to a controlled rig: programs run as users run them, only shorter."""

import io
import json
import re
import shutil
from collections.abc import Iterator
from contextlib import redirect_stdout
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")
from distributed import LocalCluster
from support.paths import CONFIG

from pendulum_rl_env.control import design
from pendulum_rl_env.scoring import SLICES, describe_reward
from pendulum_rl_env.studies import identify_and_control, sample_times, stages, transfer, tune
from pendulum_rl_env.studies.transfer_report import compute_interval, format_table

pytestmark = pytest.mark.long

TWIN = str(CONFIG / "inteco.yaml")
QUICK = """
pendulum_rl_env/InvertedPendulum-v0:
  {algorithm: ppo, timesteps: 4096, environments: 16, layers: [16], learning_rate: 0.001,
   evaluate_every: 2048, settings: {n_steps: 64, batch_size: 256, n_epochs: 2}}
"""


@dataclass(frozen=True)
class Run:
    """Hold a run of `identify_and_control`: its folder, its arguments and what it printed."""

    folder: Path
    arguments: list[str]
    printed: str


@pytest.fixture(scope="module")
def quick(tmp_path_factory: pytest.TempPathFactory) -> str:
    file = tmp_path_factory.mktemp("preset") / "quick.yaml"
    file.write_text(QUICK, encoding="utf-8")
    return str(file)


@pytest.fixture(scope="module")
def cluster() -> Iterator[list[str]]:
    """Start a worker in a thread that every study here shares; give the arguments that name it.

    Tasks reach it over TCP as they reach a process, which would import torch anew for each study.
    `test_sample_times_are_compared_a_step` starts a process.
    """
    here = LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, protocol="tcp", host="127.0.0.1",
        dashboard_address="127.0.0.1:0",
    )  # fmt: skip
    with here:
        yield ["--scheduler", here.scheduler_address]


@pytest.fixture(scope="module", autouse=True)
def search_little() -> Iterator[None]:
    """Take the first training of a twin: one of 4,096 steps is never good, so all would follow.

    A controller is designed in full by `test_classical.py`.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(stages, "MOST_TRAININGS", 1)
        patch.setattr(design, "ROUNDS", 0)
        yield


@pytest.fixture(scope="module")
def control(tmp_path_factory: pytest.TempPathFactory, quick: str) -> Run:
    folder = tmp_path_factory.mktemp("studies") / "control"
    arguments = ["--seed", "3", "--out", str(folder), "--twin", TWIN, "--preset", quick]
    arguments += ["--kinds", "single:1"]
    printed = io.StringIO()
    with redirect_stdout(printed):
        assert identify_and_control.main(arguments) == 0
    return Run(folder, arguments, printed.getvalue())


def test_one_command_goes_from_an_unknown_rig_to_an_episode_on_it(control: Run, capsys) -> None:
    assert "On the rig, with no training step there: reward" in control.printed
    clock = re.search(
        r"Clock, .*: recording 60 s, diagnosis (\d+) s, design and training (\d+) s, "
        r"an episode on the rig 15 s; (\d+) s in all",
        control.printed,
    )
    assert clock, control.printed
    diagnosis, training, whole = map(int, clock.groups())
    assert abs(whole - (60 + diagnosis + training + 15)) <= 3, "each part is rounded"
    verdict = json.loads((control.folder / "diagnosis" / "verdict.json").read_text("utf-8"))
    assert verdict["outcome"] == "named"
    assert (control.folder / "policy.onnx").stat().st_size > 1000
    assert (control.folder / "episode.gif").read_bytes()[:3] == b"GIF"
    assert identify_and_control.main(control.arguments) == 1
    assert "expected an empty folder" in capsys.readouterr().err


def test_the_study_makes_its_table_and_goes_on_from_what_is_there(
    control: Run, cluster: list[str], tmp_path: Path, quick: str, capsys
) -> None:
    out = tmp_path / "transfer"
    trial = out / "rigs" / "trial_0000"
    shutil.copytree(control.folder / "trial_0000", trial)  # recorded and diagnosed already
    shutil.copytree(control.folder / "diagnosis", trial / "found")
    arguments = ["--rigs", "1", "--seed", "3", "--out", str(out), "--twin", TWIN]
    arguments += ["--preset", quick, "--kinds", "single:1", "--fine-steps", "2048"]
    arguments += ["--trainings", "1", "--scratch-rigs", "1", "--scratch-steps", "100", *cluster]
    assert transfer.main(arguments) == 0
    first = capsys.readouterr().out
    study = json.loads((out / "transfer.json").read_text(encoding="utf-8"))
    rewards = study["rigs"][0]["rewards"]
    assert set(rewards) == {"nominal", "identified", "fine_tuned", "classical", "scratch"}
    assert rewards["classical"][0] > 400 > rewards["identified"][0]  # 4,096 steps are no training
    assert rewards["fine_tuned"][0] >= rewards["identified"][0]
    assert (out / "transfer.png").stat().st_size > 5000
    assert transfer.main(arguments) == 0
    assert capsys.readouterr().out == first


def test_a_policy_that_got_stuck_in_the_twin_is_trained_again(tmp_path: Path, monkeypatch) -> None:
    def train(twin: Path, out: Path, seed: int, options: object) -> Path:
        out.mkdir()
        result = json.dumps({"best_mean_reward": rewards[seed]})
        (out / "result.json").write_text(result, encoding="utf-8")
        return out / "policy.zip"

    monkeypatch.setattr(stages, "MOST_TRAININGS", 3)
    monkeypatch.setattr(stages, "train_policy", train)
    rewards = {5: 250.0, 1005: 430.0}
    assert (
        stages.train_until_good(Path(TWIN), tmp_path / "a", 5)
        == tmp_path / "a_again_1" / "policy.zip"
    )
    rewards = {5: 250.0, 1005: 300.0, 2005: 270.0}
    assert (
        stages.train_until_good(Path(TWIN), tmp_path / "b", 5)
        == tmp_path / "b_again_1" / "policy.zip"
    )
    rewards = {5: 450.0}
    assert stages.train_until_good(Path(TWIN), tmp_path / "c", 5) == tmp_path / "c" / "policy.zip"


def test_the_table_says_how_many_are_above_the_mark() -> None:
    rewards = {name: [430.0] for name in ("nominal", "identified", "fine_tuned", "classical")}
    rigs = [
        {"number": k, "outcome": "named", "named": ["rail_tilt"], "concealed": {"rail_tilt": {}}}
        for k in range(2)
    ]
    low = {**rewards, "nominal": [-50.0]}
    study = format_table(
        {"mark": 423.0, "rigs": [{**rigs[0], "rewards": rewards}, {**rigs[1], "rewards": low}]}
    )
    assert (
        "| 1 of 2 |" in study
        and study.count("| 2 of 2 |") == 3
        and "| 1 | rail_tilt | rail_tilt | -50 |" in study
    )


def test_an_interval_holds_the_mean_and_narrows_with_more_rigs() -> None:
    values = np.random.default_rng(0).normal(400, 30, 40)
    few, many = compute_interval(values[:10]), compute_interval(values)
    assert few[0] < values[:10].mean() < few[1] and many[1] - many[0] < few[1] - few[0]


def test_the_slices_are_those_of_table_6_and_leave_no_gap() -> None:
    assert [low for low, _, _ in SLICES] == [-np.inf, 50, 100, 190, 300, 400]
    assert [high for _, high, _ in SLICES] == [50, 100, 190, 300, 400, np.inf]


@pytest.mark.parametrize(
    ("reward", "words"),
    [
        (-50.0, "leaves"),
        (49.9, "leaves"),
        (50.0, "turns over"),
        (100.0, "more slowly"),
        (190.0, "short times"),
        (300.0, "drifts"),
        (399.9, "drifts"),
        (400.0, "near the middle without"),
        (512.0, "near the middle without"),
    ],
)
def test_a_reward_is_described_by_its_slice(reward: float, words: str) -> None:
    assert words in describe_reward(reward)


def test_sample_times_are_compared_a_step(tmp_path: Path, quick: str, capsys) -> None:
    arguments = [
        "--twin",
        TWIN,
        "--out",
        str(tmp_path / "s"),
        "--step-s",
        "0.02",
        "0.06",
        "--seeds",
        "1",
        "--timesteps",
        "2048",
        "--preset",
        quick,
        "--processes",
        "1",
    ]
    assert sample_times.main(arguments) == 0
    assert "| 0.02 | 768 |" in capsys.readouterr().out
    rows = json.loads((tmp_path / "s" / "sample_times.json").read_text(encoding="utf-8"))
    assert [row["steps_an_episode"] for row in rows] == [768, 256] and all(
        -1 < row["median"] < 1 for row in rows
    )


def test_a_study_of_settings_stays_on_the_disk_and_goes_on(
    cluster: list[str], tmp_path: Path, quick: str, capsys
) -> None:
    arguments = ["--preset", quick, "--twin", TWIN, "--out", str(tmp_path / "study"), *cluster]
    arguments += ["--trials", "1", "--timesteps", "2048"]
    assert tune.main(arguments) == 0 and tune.main(arguments) == 0
    said = capsys.readouterr().out
    assert "after 1 trials" in said and "after 2 trials" in said


@pytest.mark.parametrize("program", [identify_and_control, transfer])
def test_a_twin_that_is_none_ends_in_a_sentence(program, tmp_path: Path, capsys) -> None:
    assert (
        program.main(["--seed", "1", "--out", str(tmp_path / "x"), "--twin", "nowhere.yaml"]) == 1
    )
    said = capsys.readouterr().err
    assert "nowhere.yaml" in said and "Traceback" not in said
