"""The command line: exit status, one sentence for a fault, and files whole or not there."""

import json
import math
import os
import re
import shlex
import subprocess
import sys
import webbrowser
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.made_recordings import INTECO, ROOT, made, made_bag, without_joint

from pendulum_sysid.cli import main
from pendulum_sysid.finding.stages import Stage
from pendulum_sysid.records import Outcome
from pendulum_sysid.verbs import recordings
from pendulum_sysid.verbs.diagnose import describe_origin, write_diagnosis
from pendulum_sysid.verbs.fit import explain_worse_fit
from pendulum_sysid.verbs.options import make_parser
from pendulum_sysid.verdict.record import RecordingFacts, Verdict
from pendulum_sysid.verdict.scores import BeforeAfter, FitScores
from pendulum_twin.effects import CATALOGUE
from pendulum_twin.laws.law import Law
from pendulum_twin.model import Twin, load_twin, save_twin
from pendulum_twin.user_effects import take_effects_option

REAL = ROOT.parent / "shared" / "data" / "inteco_rig"
TWIN = str(ROOT / "config" / "inteco.yaml")


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> str:
    return str(made_bag(tmp_path_factory.mktemp("bags") / "made", made(INTECO, 12.0)))


@pytest.fixture(scope="module")
def wrong(tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("twins") / "wrong.yaml"
    save_twin(replace(INTECO, rig=replace(INTECO.rig, force_per_pwm_n=16.0)), path)
    return str(path)


def drop_progress(said: str) -> str:
    """Return what a program said without its progress, which only a slow machine shows."""
    return "".join(line for line in said.splitlines(True) if not line.endswith("so far)\n"))


def refused(capsys: pytest.CaptureFixture[str], *arguments: object, status: int = 1) -> str:
    """Run a command that must not answer and return its one line on stderr."""
    assert main([str(a) for a in arguments]) == status
    said = capsys.readouterr()
    assert said.out == ""
    complaint = drop_progress(said.err)
    assert complaint.count("\n") == 1 and complaint.startswith("sysid: ")
    return complaint


# Wrong input


@pytest.mark.parametrize("words", [("fit",), ("fit", "--method", "thesis"), ("next",)])
def test_positions_in_millimetres_are_fitted_by_no_verb(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, words: tuple[str, ...]
) -> None:
    recording = made(INTECO, 12.0)
    signals = replace(recording.signals, cart=1000.0 * recording.signals.cart)
    bag = made_bag(tmp_path / "bag", replace(recording, signals=signals))
    out = tmp_path / "out.yaml"
    said = refused(capsys, "--quiet", *words, bag, "--twin", TWIN, "--out", out)
    assert "--length-unit mm" in said and not out.exists()


def test_errors_of_positions_in_millimetres_are_told_with_a_warning(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    recording = made(INTECO, 12.0)
    signals = replace(recording.signals, cart=1000.0 * recording.signals.cart)
    bag = str(made_bag(tmp_path / "bag", replace(recording, signals=signals)))
    for words in (
        ["replay", bag, "--twin", TWIN],
        ["compare", bag, "--twin", TWIN, "--twin", TWIN],
    ):
        assert main(["--quiet", *words]) == 0
        assert "--length-unit mm" in capsys.readouterr().err


def test_a_recording_that_is_cut_off_is_said_to_be_so(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    bag = made_bag(tmp_path / "bag", made(INTECO, 12.0))
    file = next(bag.glob("*.mcap"))
    file.write_bytes(file.read_bytes()[: file.stat().st_size * 2 // 3])
    out = str(tmp_path / "out.yaml")
    for words in (["replay"], ["fit", "--out", out], ["next", "--out", out]):
        assert main(["--quiet", words[0], str(bag), "--twin", TWIN, *words[1:]]) == 0
        said = capsys.readouterr().err
        assert (
            "expected a whole recording, found" in said and "unreadable or out of order: " in said
        )


def test_a_fit_of_another_rig_is_doubted_before_its_twin_is_used(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    rig = INTECO.rig
    longer = {"com_distance_m": 2.4 * rig.com_distance_m}
    long = replace(rig, **longer, pole_inertia_kg_m2=6.0 * rig.pole_inertia_kg_m2)
    bag = made_bag(tmp_path / "bag", made(replace(INTECO, rig=long)))
    words = ["--quiet", "fit", str(bag), "--twin", TWIN, "--out", str(tmp_path / "out.yaml")]
    assert main(words) == 0
    assert "check that this is the twin of this rig" in capsys.readouterr().err


def test_a_missing_recording(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    said = refused(
        capsys, "diagnose", tmp_path / "none", "--twin", TWIN, "--out", tmp_path / "out"
    )
    assert "none: expected a recording" in said and "found nothing there" in said
    assert not (tmp_path / "out").exists()


def test_a_recording_too_short_is_named(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    path = made_bag(tmp_path / "short", made(INTECO, 0.5))
    assert f"{path}: expected at least" in refused(capsys, "replay", path, "--twin", TWIN)


@pytest.mark.parametrize("verb", ["replay", "compare", "fit", "diagnose"])
def test_a_bad_twin(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, bag: str, verb: str
) -> None:
    path = tmp_path / "twin.yaml"
    path.write_text(Path(TWIN).read_text().replace("cart_viscous_n_s_m", "cart_viscous_n"))
    more = {
        "compare": ["--twin", TWIN],
        "fit": ["--out", tmp_path / "o.yaml"],
        "diagnose": ["--out", tmp_path / "o"],
    }
    said = refused(capsys, verb, bag, "--twin", path, *more.get(verb, []))
    assert "unknown key cart_viscous_n; did you mean cart_viscous_n_s_m" in said
    assert [p.name for p in tmp_path.iterdir()] == ["twin.yaml"]


def test_a_twin_that_is_not_there(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, bag: str
) -> None:
    assert "expected a twin file" in refused(
        capsys, "replay", bag, "--twin", tmp_path / "none.yaml"
    )


def test_the_same_recording_twice(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, bag: str
) -> None:
    words = ["fit", bag, bag, "--twin", TWIN, "--out", tmp_path / "o.yaml"]
    said = refused(capsys, *words, status=2)
    assert "found this one twice" in said


def test_another_topic(capsys: pytest.CaptureFixture[str], bag: str) -> None:
    words = ["replay", bag, "--twin", TWIN, "--state-topic", "/else"]
    said = refused(capsys, *words, status=2)
    assert "expected the topic /else" in said


@pytest.mark.parametrize("verb", ["fit", "compare"])
def test_a_place_that_cannot_be_written(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, bag: str, verb: str
) -> None:
    (tmp_path / "file").write_text("in the way")
    more = ["--twin", TWIN] if verb == "compare" else []
    said = refused(capsys, verb, bag, "--twin", TWIN, *more, "--out", tmp_path / "file" / "o.png")
    assert "expected a folder to write to" in said and "which is a file" in said


def test_diagnose_into_a_file(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, bag: str
) -> None:
    (tmp_path / "file").write_text("in the way")
    assert "which is a file" in refused(
        capsys, "diagnose", bag, "--twin", TWIN, "--out", tmp_path / "file"
    )


def test_a_file_where_a_folder_stands(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, bag: str
) -> None:
    assert "found a folder" in refused(capsys, "fit", bag, "--twin", TWIN, "--out", tmp_path)


def test_a_picture_of_unknown_kind(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, bag: str
) -> None:
    words = ["compare", bag, "--twin", TWIN, "--twin", TWIN, "--out", tmp_path / "plot.txt"]
    assert "found .txt" in refused(capsys, *words, status=2)


@pytest.mark.parametrize(
    "line",
    [
        "",
        "guess",
        "replay",
        "replay BAG",
        "replay BAG --twin T --jsn",
        "fit BAG --twin T --out O --method best",
        "fit BAG --twin T --out O --max-evaluations 0",
        "fit BAG --twin T --out O --max-evaluations 5",
        "import FILE --out BAG --time t",
        "import FILE --out BAG --time t --cart x --skip -1",
        "import FILE --out BAG --command u --cart x",
        "import FILE --out BAG --time t --rate 100 --command u --cart x",
        "import FILE --out BAG --time t --command u --cart x --length-unit inch",
        "check BAG",
        "compare BAG --twin A",
        "compare BAG --twin A --twin B --twin C",
        "replay BAG --twin A --twin B",
        "diagnose BAG --twin A --twin A --out O",
        "fit BAG --twin T --out O --method thesis --hold all",
    ],
)
def test_wrong_use_is_status_2(capsys: pytest.CaptureFixture[str], line: str) -> None:
    with pytest.raises(SystemExit) as ended:
        main(line.split())
    assert ended.value.code == 2
    assert "usage: sysid" in capsys.readouterr().err


# Trouble from inside


def broken(error: BaseException):
    def cleaned(raw: object) -> None:
        raise error

    return cleaned


def test_an_internal_error_is_one_sentence(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, bag: str
) -> None:
    monkeypatch.setattr(recordings, "clean_recording", broken(RuntimeError("two\nlines")))
    said = refused(capsys, "replay", bag, "--twin", TWIN)
    assert (
        said == "sysid: internal error (RuntimeError: two lines): "
        "please report it, with --traceback for details\n"
    )
    for line in (
        ["--traceback", "replay", bag, "--twin", TWIN],
        ["replay", bag, "--twin", TWIN, "--traceback"],
    ):
        with pytest.raises(RuntimeError):
            main(line)


def test_the_keyboard_stops_it(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, bag: str
) -> None:
    monkeypatch.setattr(recordings, "clean_recording", broken(KeyboardInterrupt()))
    assert main(["replay", bag, "--twin", TWIN]) == 130
    said = drop_progress(capsys.readouterr().err)
    assert said == "sysid: stopped by the keyboard before the question was answered\n"


def test_a_reader_that_leaves_is_no_traceback() -> None:
    run = f"{sys.executable} -m pendulum_sysid.cli effects | head -c 1"
    places = os.pathsep.join(
        str(ROOT / "src" / name) for name in ("pendulum_twin", "pendulum_sysid")
    )
    done = subprocess.run(
        ["sh", "-c", run], env=os.environ | {"PYTHONPATH": places}, capture_output=True, timeout=60
    )
    assert done.stderr == b""


# Right use


def test_replay_prints_one_json_object(
    capsys: pytest.CaptureFixture[str], bag: str, wrong: str
) -> None:
    scores, floors = [], []
    for twin in (TWIN, wrong):
        assert main(["replay", bag, "--twin", twin, "--json"]) == 0
        found = json.loads(capsys.readouterr().out)
        assert list(found) == ["windows", "whole"]
        assert list(found["windows"]) == [
            "seconds",
            "count",
            "cart_rmse_m",
            "pole_rmse_rad",
            "score",
            "noise_floor",
        ]
        assert list(found["whole"]) == ["thesis_rmse"]
        assert found["windows"]["seconds"] == 1.0 and found["windows"]["count"] == 22
        scores.append(found["windows"]["score"])
        floors.append(found["windows"]["noise_floor"])
    assert scores[1] > 10 * scores[0] > 5 * floors[0] > 5.0


def test_replay_of_a_pole_alone(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    path = made_bag(tmp_path / "pole", without_joint(made(INTECO, 5.0), "cart"))
    assert main(["replay", str(path), "--twin", TWIN, "--json"]) == 0
    windows = json.loads(capsys.readouterr().out)["windows"]
    assert windows["cart_rmse_m"] is None and windows["pole_rmse_rad"] > 0.0


def test_a_run_that_diverges_is_null_with_a_sentence(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, bag: str
) -> None:
    stiff = replace(INTECO, rig=replace(INTECO.rig, cart_viscous_n_s_m=1e4))
    save_twin(stiff, tmp_path / "twin.yaml")
    assert main(["replay", bag, "--twin", str(tmp_path / "twin.yaml"), "--json"]) == 0
    said = capsys.readouterr()
    windows = json.loads(said.out)["windows"]
    assert windows["score"] is None and windows["noise_floor"] is None
    assert "a run of this twin diverged" in said.err and said.err.count("\n") == 1


def test_replay_for_a_person(capsys: pytest.CaptureFixture[str], bag: str) -> None:
    assert main(["replay", bag, "--twin", TWIN]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "22 windows of 1 s"
    assert [line.split("  ")[0] for line in lines[2:]] == [
        "windows, cart RMSE", "windows, pole RMSE", "windows, score",
        "windows, noise floor of the score", "whole run, equation 29",
    ]  # fmt: skip


def test_compare_says_which_is_better_and_draws(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, bag: str, wrong: str
) -> None:
    plot = tmp_path / "new" / "plot.png"
    assert main(["compare", bag, "--twin", wrong, "--twin", TWIN, "--out", str(plot)]) == 0
    said = capsys.readouterr().out
    assert f"{TWIN} is the better one in 22 windows of 22" in said
    floors = next(line for line in said.splitlines() if "noise floor" in line)
    assert [float(floor) > 1.0 for floor in re.findall(r"\d[\d.]*", floors)] == [True, True]
    assert plot.read_bytes().startswith(b"\x89PNG")


def test_fit_finds_the_force_again(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, bag: str, wrong: str
) -> None:
    out = tmp_path / "fitted.yaml"
    assert main(["fit", bag, "--twin", wrong, "--out", str(out)]) == 0
    said, progress = capsys.readouterr()
    assert re.search(r"^fitting \d+ windows$", progress, re.MULTILINE), "no share: no stages"
    assert load_twin(out).rig.force_per_pwm_n == pytest.approx(
        INTECO.rig.force_per_pwm_n, rel=0.01
    )
    row = next(line for line in said.splitlines() if line.startswith("force_per_pwm_n")).split()
    assert row[1] == "16" and row[-2:] == ["N", "yes"]
    score = next(line for line in said.splitlines() if line.startswith("score")).split()
    assert float(score[2]) < 0.1 * float(score[1])
    floor = next(line for line in said.splitlines() if line.startswith("noise floor")).split()
    assert 1.0 < float(floor[-5]) < 2.0 * float(score[2])


@pytest.mark.parametrize(
    ("verb", "work"),
    [
        ("diagnose", "pendulum_sysid.pipeline.diagnose"),
        ("next", "pendulum_sysid.verbs.next.search_settled"),
    ],
)
def test_verbs_with_stages_say_their_share(
    verb: str,
    work: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    bag: str,
) -> None:
    def stop(*given: Any) -> None:
        given[-1](Stage.CONSTANTS)
        raise KeyboardInterrupt

    monkeypatch.setattr(work, stop)
    assert main([verb, bag, "--twin", TWIN, "--out", str(tmp_path / "out")]) == 130
    progress = capsys.readouterr().err
    assert re.search(r"^ *\d+ %, about \d+ s left: fitting the rig's", progress, re.MULTILINE)


def test_fit_by_the_thesis(capsys: pytest.CaptureFixture[str], tmp_path: Path, bag: str) -> None:
    out = tmp_path / "thesis.yaml"
    line = [
        "fit",
        bag,
        "--twin",
        TWIN,
        "--out",
        str(out),
        "--method",
        "thesis",
        "--max-evaluations",
        "60",
    ]
    assert main(line) == 0
    said = capsys.readouterr().out
    assert (
        "moved by %" in said
        and "equation 29 on the fitted record" in said
        and "nothing was held out" in said
    )
    assert "cart_saturating_friction" in load_twin(out).effects


def test_what_the_thesis_does_not_have_is_told(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, bag: str
) -> None:
    law = Law((-0.3, 0.0, 0.3), (0.5, 0.0, -0.5))
    save_twin(replace(INTECO, measured_laws={"cart_force_by_position": law}), tmp_path / "t.yaml")
    words = ["fit", bag, "--twin", str(tmp_path / "t.yaml"), "--out", str(tmp_path / "o.yaml")]
    assert main([*words, "--method", "thesis", "--max-evaluations", "1"]) == 0
    said = capsys.readouterr().err
    assert "has no such effect or measured law: cart_force_by_position" in said


def test_fit_of_several_recordings(tmp_path: Path, bag: str, wrong: str) -> None:
    other = made_bag(tmp_path / "other", made(INTECO, 6.0, 0.15, seed=3))
    assert (
        main(["fit", bag, str(other), "--twin", wrong, "--out", str(tmp_path / "fitted.yaml")])
        == 0
    )
    assert load_twin(tmp_path / "fitted.yaml").rig.force_per_pwm_n == pytest.approx(
        12.86, rel=0.01
    )


def test_effects_lists_the_catalogue(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["effects", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["effects"]
    assert [one["name"] for one in found] == [effect.name for effect in CATALOGUE]
    for one in found:
        assert set(one) == {"name", "place", "parameters", "searched", "sentence", "source"}
        assert all(set(p) == {"name", "unit", "neutral", "low", "high"} for p in one["parameters"])
    assert main(["effects"]) == 0
    text = capsys.readouterr().out
    assert (
        "cart_coulomb_friction (cart)" in text
        and "level_n [N]: from 0" in text
        and "{" not in text
    )


def test_import_makes_a_recording_of_a_csv_file(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    signals = made(INTECO, 5.0).signals
    times = np.arange(len(signals)) * signals.period_s
    table = np.stack([times, signals.command, -signals.cart, signals.pole - np.pi], axis=1)
    np.savetxt(
        tmp_path / "run.csv", table, delimiter=",", header="t,u,x,theta", comments="", fmt="%.12g"
    )
    columns = "--time t --command u --cart x --pole theta"
    line = f"import {tmp_path}/run.csv --out {tmp_path}/bag {columns} --skip 1"
    assert main([*line.split(), "--pole-zero", "down", "--invert-cart"]) == 0
    printed = capsys.readouterr().out.splitlines()
    assert printed[:2] == [f"{tmp_path}/bag", "400 rows in 3.99 s: 100 Hz"]
    assert [line.split()[0] for line in printed[2:]] == ["command", "cart", "pole"]
    assert main(["replay", f"{tmp_path}/bag", "--twin", TWIN, "--json"]) == 0
    windows = json.loads(capsys.readouterr().out)["windows"]
    assert windows["count"] == 6 and windows["score"] < 10.0


def test_import_of_a_column_that_is_not_there(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    (tmp_path / "run.csv").write_text("t,x\n0,0\n1,0\n")
    words = ["import", tmp_path / "run.csv", "--out", tmp_path / "bag", "--time", "t"]
    said = refused(capsys, *words, "--command", "x", "--cart", "y", status=2)
    assert "expected a column y, found t, x" in said
    assert not (tmp_path / "bag").exists()


def test_several_files_become_recordings_side_by_side(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    for name in ("a", "b"):
        np.savetxt(tmp_path / f"{name}.csv", np.arange(30.0).reshape(10, 3), delimiter=",")
    files = [str(tmp_path / f"{name}.csv") for name in ("a", "b")]
    columns = ["--command", "1", "--cart", "2", "--rate", "1"]
    assert main(["import", *files, "--out", str(tmp_path / "out"), *columns]) == 0
    printed = capsys.readouterr()
    assert f"{tmp_path}/out/a" in printed.out and f"{tmp_path}/out/b" in printed.out
    assert "found 1: is it another --time-unit?" in printed.err
    assert (tmp_path / "out" / "b" / "metadata.yaml").is_file()


# Whether a recording can be of the rig


def test_check_prints_a_table_and_says_yes(capsys: pytest.CaptureFixture[str], bag: str) -> None:
    assert main(["check", bag, "--twin", TWIN]) == 0
    printed = capsys.readouterr()
    assert printed.out.splitlines()[0].split() == ["question", "answer", "expected", "found"]
    assert "Is the angle 0 upright?" in printed.out
    assert drop_progress(printed.err) == ""


def test_check_ends_with_status_1_and_the_sentence_of_the_first_no(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    recording = made(INTECO, 10.0)
    signals = replace(recording.signals, cart=1e3 * recording.signals.cart)
    path = made_bag(tmp_path / "mm", replace(recording, signals=signals))
    assert main(["check", str(path), "--twin", TWIN, "--json"]) == 1
    printed = capsys.readouterr()
    checks = json.loads(printed.out)["checks"]
    assert {frozenset(c) for c in checks} == {
        frozenset({"question", "answer", "expected", "found", "advice"})
    }
    failed = [c for c in checks if c["answer"] == "no"]
    assert failed[0]["advice"] == "import the file with --length-unit mm"
    assert ["agree with gravity" in c["question"] for c in failed[1:]] == [True]  # in mm, too
    assert printed.err.startswith("sysid: expected a cart that moves over at most the rail's")


# What a diagnosis leaves behind


def make_named_verdict(twin: Twin | None = INTECO) -> Verdict:
    recording = RecordingFacts("made", 60.0, 6000, 100.0, "sha256:1", 0.0, 0.0)
    scores = BeforeAfter(math.inf, 1.1)
    fit = FitScores(train=scores, held_out=scores, noise_floor=1.0)
    return Verdict(
        Outcome.NAMED, "Found.", None, (), {}, (), fit, None, (), None, recording, 1.0, twin=twin
    )


def test_a_diagnosis_is_written(tmp_path: Path) -> None:
    folder = tmp_path / "new" / "out"
    written = write_diagnosis(make_named_verdict(), folder, Path(TWIN))
    assert [path.name for path in written] == ["verdict.json", "report.html", "twin.yaml"]
    content = json.loads((folder / "verdict.json").read_text())
    assert content["fit"]["train"]["before"] is None and content["sentence"] == "Found."
    assert load_twin(folder / "twin.yaml") == INTECO
    assert {path.name for path in folder.iterdir()} == {path.name for path in written}


def test_a_diagnosis_remembers_the_effects_of_its_user(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "twin.yaml").write_text("")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PENDULUM_EFFECTS", "")
    line = "diagnose run --effects mine --twin twin.yaml --out out --effects /theirs"
    arguments = make_parser().parse_args(take_effects_option(shlex.split(line)))
    assert describe_origin(arguments).effects == ("mine", "/theirs")
    monkeypatch.setenv("PENDULUM_EFFECTS", "")
    assert describe_origin(arguments).effects == ()


def test_no_twin_of_an_earlier_diagnosis_stays(tmp_path: Path) -> None:
    write_diagnosis(make_named_verdict(), tmp_path, Path(TWIN))
    written = write_diagnosis(make_named_verdict(twin=None), tmp_path, Path(TWIN))
    assert [path.name for path in written] == ["verdict.json", "report.html"]
    assert not (tmp_path / "twin.yaml").exists()


def test_the_twin_that_was_started_from_is_never_removed(tmp_path: Path) -> None:
    save_twin(INTECO, tmp_path / "twin.yaml")
    write_diagnosis(make_named_verdict(twin=None), tmp_path, tmp_path / "twin.yaml")
    assert load_twin(tmp_path / "twin.yaml") == INTECO


# The real rig


@pytest.mark.skipif(
    not REAL.exists(), reason="the INTECO recording is not beside the repository (../shared/data)"
)
def test_replay_of_the_real_rig_gives_numbers(capsys: pytest.CaptureFixture[str]) -> None:
    assert (
        main(
            ["replay", str(REAL / "open_loop_0_60s"), "--twin", str(REAL / "twin.yaml"), "--json"]
        )
        == 0
    )
    found = json.loads(capsys.readouterr().out)
    assert found["windows"]["count"] > 100
    assert np.isfinite([*found["windows"].values(), *found["whole"].values()]).all()


# Several recordings, JSON, pages


@pytest.fixture(scope="module")
def second_bag(tmp_path_factory: pytest.TempPathFactory) -> str:
    return str(made_bag(tmp_path_factory.mktemp("bags") / "second", made(INTECO, 8.0, seed=2)))


def ask_json(capsys: pytest.CaptureFixture[str], *arguments: object) -> dict:
    assert main([*(str(a) for a in arguments), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert isinstance(answer, dict)
    return answer


def test_replay_and_compare_take_several_recordings(
    capsys: pytest.CaptureFixture[str], bag: str, second_bag: str, wrong: str
) -> None:
    counts = [
        ask_json(capsys, "replay", *bags, "--twin", TWIN)["windows"]["count"]
        for bags in ([bag], [second_bag], [bag, second_bag])
    ]
    assert counts[0] > counts[1] > 0 and counts[2] == counts[0] + counts[1]
    pair = ask_json(capsys, "compare", bag, second_bag, "--twin", wrong, "--twin", TWIN)
    assert pair["windows"] == counts[2] and pair["second_better_in"] > 0.9 * counts[2]
    first, second = pair["twins"]
    assert first["windows"]["score"] > 10 * second["windows"]["score"]
    assert [twin["twin"] for twin in pair["twins"]] == [wrong, TWIN]


def test_fit_and_import_answer_in_json(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, bag: str, wrong: str
) -> None:
    out = tmp_path / "fitted.yaml"
    fitted = ask_json(capsys, "fit", bag, "--twin", wrong, "--out", out)
    force = fitted["parameters"]["force_per_pwm_n"]
    assert force["before"] == 16.0
    assert force["value"] == pytest.approx(INTECO.rig.force_per_pwm_n, rel=0.02)
    assert fitted["held_out"]["after"]["score"] < fitted["held_out"]["before"]["score"]
    assert fitted["file"] == str(out) and out.is_file()
    csv = tmp_path / "run.csv"
    csv.write_text("t,u,x\n" + "".join(f"{k / 100},0.1,{k / 1e4}\n" for k in range(500)))
    words = ["--out", tmp_path / "run", "--time", "t", "--command", "u", "--cart", "x"]
    (imported,) = ask_json(capsys, "import", csv, *words)["recordings"]
    assert imported["rows"] == 500 and imported["ranges"]["cart"] == pytest.approx([0.0, 0.0499])


def test_a_misspelt_column_is_hinted_at(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    csv = tmp_path / "run.csv"
    csv.write_text("time,volts,theta\n0,0,0\n1,0,0\n")
    words = ["--out", tmp_path / "run", "--time", "time", "--pole", "thetta"]
    assert "did you mean theta?" in refused(capsys, "import", csv, *words, status=2)


def test_a_misspelt_constant_is_hinted_at(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, bag: str
) -> None:
    words = ["--twin", TWIN, "--out", tmp_path / "o.yaml", "--hold", "pole_inertia"]
    said = refused(capsys, "fit", bag, *words, status=2)
    assert "did you mean pole_inertia_kg_m2?" in said


def test_a_worse_fit_at_the_noise_floor_blames_no_missing_physics() -> None:
    assert "is at the noise" in explain_worse_fit(18.7, 18.8)
    for floor in (2.0, None):
        assert "no parameter repairs what is missing" in explain_worse_fit(18.7, floor)


def test_a_fit_of_nothing_is_refused(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, bag: str
) -> None:
    out = tmp_path / "fitted.yaml"
    said = refused(
        capsys, "fit", bag, "--twin", TWIN, "--out", out, "--hold", "all", "--quiet", status=2
    )
    assert "expected a parameter to fit, found all of them held" in said
    assert not out.exists()


@pytest.mark.parametrize(
    "angle", [["--cart", "x", "--cos", "c"], ["--pole", "c", "--sin", "c", "--cos", "c"]]
)
def test_an_angle_that_is_given_half_or_twice_is_wrong_use(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, angle: list[str]
) -> None:
    (tmp_path / "run.csv").write_text("t,u,x,c\n0,0,0,1\n1,0,0,1\n")
    words = ["--out", tmp_path / "bag", "--time", "t", "--command", "u", *angle]
    said = refused(capsys, "import", tmp_path / "run.csv", *words, status=2)
    assert "give the angle one way" in said


def test_a_folder_without_effects_is_said_by_the_program(tmp_path: Path) -> None:
    program = tmp_path / "sysid"
    program.write_text("from pendulum_sysid.cli import main\nmain()\n")
    places = os.pathsep.join(
        str(ROOT / "src" / name) for name in ("pendulum_twin", "pendulum_sysid")
    )
    done = subprocess.run(
        [sys.executable, program, "effects", "--effects", tmp_path / "nope"],
        env=os.environ | {"PYTHONPATH": places},
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.returncode == 2
    assert done.stderr.startswith(f"sysid: {tmp_path / 'nope'}: expected a folder with effects")


def test_open_shows_the_report_in_the_browser(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shown: list[str] = []
    monkeypatch.setattr(webbrowser, "open", lambda url: shown.append(url) is None)
    report = tmp_path / "demo" / "diagnosis" / "report.html"
    report.parent.mkdir(parents=True)
    report.write_text("<title>report</title>")
    for place in (report, report.parent, tmp_path / "demo"):
        assert ask_json(capsys, "open", place) == {"page": str(report), "opened": True}
    assert shown == 3 * [report.as_uri()]


def test_open_says_where_the_page_is_without_a_browser(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(webbrowser, "open", lambda url: False)
    (tmp_path / "index.html").write_text("<title>fleet</title>")
    assert main(["open", str(tmp_path)]) == 0
    said = capsys.readouterr()
    assert said.out == f"{tmp_path / 'index.html'}\n" and "open the file yourself" in said.err


def test_open_of_a_folder_without_a_page(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    (tmp_path / "mine").mkdir()
    assert "expected a folder with report.html" in refused(capsys, "open", tmp_path / "mine")
    assert "did you mean mine?" in refused(capsys, "open", tmp_path / "mien")
