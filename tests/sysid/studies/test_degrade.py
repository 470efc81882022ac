"""The study of degraded recordings: kinds degrade as they say, scores are just, a run repeats."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.degraded import make_raw
from support.paths import ROOT

from pendulum_sysid.cli import main
from pendulum_sysid.errors import UnusableRecording
from pendulum_sysid.fleet.engine import Engine
from pendulum_sysid.studies.proof.degrade.kinds import BY_NAME, DEGRADATIONS
from pendulum_sysid.studies.proof.degrade.score import Score, score_answer
from pendulum_sysid.studies.proof.degrade.study import Study, run_study
from pendulum_sysid.studies.proof.records import OpenedTrial, Seal
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import load_twin

RAW = make_raw(30.0)
TWIN = ROOT / "config" / "inteco.yaml"
RIG = load_twin(TWIN).rig
DRY = {"cart_coulomb_friction": {"level_n": 0.5}}


@pytest.mark.parametrize("kind", [d.name for d in DEGRADATIONS if d.name != "upright"])
def test_a_degraded_recording_is_a_recording_and_the_same_again(kind: str) -> None:
    degraded, again = (BY_NAME[kind].degrade(RAW, np.random.default_rng(1)) for _ in range(2))
    for channel in ("state_stamp_s", "cart", "pole", "command_stamp_s", "command"):
        assert np.array_equal(getattr(degraded, channel), getattr(again, channel))
    assert np.all(np.diff(degraded.state_stamp_s) >= 0) and len(degraded.state_stamp_s) > 100


def test_a_recording_of_a_pole_that_is_never_upright_is_unusable() -> None:
    hanging = replace(RAW, pole=np.full(len(RAW.state_stamp_s), np.pi))
    with pytest.raises(UnusableRecording, match="found 0"):
        BY_NAME["upright"].degrade(hanging, np.random.default_rng(1))


def test_there_are_24_kinds() -> None:
    assert len(DEGRADATIONS) == len(BY_NAME) == 24


def make_trial(effects: dict[str, dict[str, float]]) -> OpenedTrial:
    seal = Seal(effects, RIG.to_mapping())
    return OpenedTrial("t", Path(), TWIN, "single", 1, 4096, 60.0, False, 1.0, seal)


def make_answer(
    outcome: str = "named", value: float = 0.5, after: float = 1.0, effect: str | None = None
) -> dict[str, object]:
    entry = {
        "effect": effect or "cart_coulomb_friction",
        "cannot_be_told_from": [],
        "parameters": {"level_n": {"value": value, "low": value - 0.01, "high": value + 0.01}},
    }
    fit = {"held_out": {"before": 99.0, "after": after}, "noise_floor": 1.0}
    named = [entry] if outcome == "named" else []
    return {"outcome": outcome, "missing_physics": named, "fit": fit, "rig_parameters": {}}


@pytest.mark.parametrize(
    ("effects", "answer", "expected"),
    [
        (DRY, make_answer(), Score.RIGHT),
        (DRY, make_answer(value=0.53), Score.WRONG),  # 6 %, and three half widths
        (DRY, make_answer(value=0.515), Score.RIGHT),
        (DRY, make_answer(effect="cart_quadratic_drag"), Score.WRONG),
        (DRY, make_answer("unusable"), Score.LESS),
        (DRY, make_answer("not_in_catalogue"), Score.LESS),
        (DRY, make_answer("nothing_missing"), Score.LESS),
        (DRY, make_answer("nothing_missing", after=5.0), Score.WRONG),
        ({}, make_answer("nothing_missing"), Score.RIGHT),
        ({}, make_answer("unusable"), Score.LESS),
        ({}, make_answer("not_in_catalogue"), Score.WRONG),
        ({}, make_answer(), Score.WRONG),
    ],
)
def test_scores(effects: dict, answer: dict, expected: Score) -> None:
    assert score_answer(make_trial(effects), answer, "", RIG).score is expected


def test_a_crash_is_wrong() -> None:
    scored = score_answer(replace(make_trial(DRY)), {}, "ValueError: no", RIG)
    assert scored.score is Score.WRONG and scored.why == "ValueError: no"


def test_a_small_study(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    argv = ["prove", "--trials", "1", "--seed", "3", "--out", str(tmp_path), "--processes", "1"]
    assert main([*argv, "--degrade", "loss_20,smoothed"]) == 0
    rows = json.loads((tmp_path / "degraded.json").read_text())["rows"]
    assert [(row["kind"], row["outcome"], row["score"]) for row in rows] == [
        ("loss_20", "unusable", "says less"),
        ("smoothed", "unusable", "says less"),
    ]
    assert "20 % of the messages lost" in capsys.readouterr().out
    assert main([*argv, "--degrade", "none_such"]) == 2
    assert "expected kinds among loss_1" in capsys.readouterr().err


def test_a_folder_holds_a_study_of_one_seed(tmp_path: Path) -> None:
    """The answers of an earlier seed were given out as those of the later."""
    folder = tmp_path / "study"
    quick = Study(0, 3, ("smoothed",), Engine(1))
    assert run_study(quick, folder, print) == []
    assert run_study(replace(quick, kinds=("loss_20",)), folder, print) == []
    for other in (replace(quick, seed=4), replace(quick, twin=str(TWIN))):
        with pytest.raises(BadInputError, match="name another folder"):
            run_study(other, folder, print)
