"""The proof as it runs: trials that the twin made are examined in processes of their own, kept, judged and written."""

import json
import multiprocessing
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from support.prove_trials import recorded

from pendulum_sysid.cli import main
from pendulum_sysid.studies.proof import examine_trial as examine
from pendulum_sysid.studies.proof import record_trial as trials
from pendulum_sysid.studies.proof.oracle_fit import make_true_twin
from pendulum_sysid.studies.proof.plan import Plan, claim_folder
from pendulum_sysid.studies.proof.read_trial import read_trial
from pendulum_sysid.studies.proof.record_trial import folder_of, stretches, trial_folders
from pendulum_sysid.studies.proof.records import NamesOutcome
from pendulum_sysid.studies.proof.rivals import RIVALS, find_rival, sparse_regression
from pendulum_sysid.studies.proof.workers import examine_trials
from pendulum_twin.errors import BadInputError

COULOMB = {"cart_coulomb_friction": {"level_n": 0.5}}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder in which two trials have been recorded, and none examined."""
    folder = tmp_path_factory.mktemp("proof")
    for number, effects in enumerate((COULOMB, {})):
        recorded(folder_of(folder / "trials", number), effects, seed=number + 1)
    return folder


def run(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str, str]:
    status = main(["prove", *(str(a) for a in arguments)])
    said = capsys.readouterr()
    return status, said.out, said.err


def test_a_small_proof(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status, out, err = run(capsys, "--trials", 2, "--seed", 1, "--out", folder)
    assert status == 0
    assert "2/2" in err and out.splitlines()[-1] == str(folder / "proof.html")
    found = json.loads((folder / "proof.json").read_text())
    assert [one["judged"]["how"] for one in found["trials"]] == ["right", "right"]
    (level,) = [
        one for one in found["trials"][0]["sizes"] if one["owner"] == "cart_coulomb_friction"
    ]
    assert level["true"] == 0.5 and level["relative_error"] < 0.05
    ratio = found["trials"][0]["held_out"]["ratio"]
    assert 0.8 < ratio < 1.2
    assert "<html" in (folder / "proof.html").read_text()
    before = {path: path.stat().st_mtime_ns for path in folder.glob("trials/*/examined.json")}
    assert run(capsys, "--trials", 2, "--seed", 1, "--out", folder)[0] == 0
    assert len(before) == 2 and {path: path.stat().st_mtime_ns for path in before} == before
    status, _, err = run(capsys, "--trials", 2, "--seed", 2, "--out", folder)
    assert (
        status == 1 and "expected the proof that began there with seed = 1, found seed = 2" in err
    )


def test_rivals_find_plain_friction(folder: Path) -> None:
    ground = examine._ground(read_trial(folder_of(folder / "trials", 0)))
    for name in ("all_at_once", "sparse_regression"):
        if name == "sparse_regression":
            pytest.importorskip(sparse_regression.PACKAGE)
        named = find_rival(name).answer(ground)
        assert "cart_coulomb_friction" in named or "cart_stribeck_friction" in named, name


def test_a_rival_that_breaks_off_is_an_answer(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def breaks(ground: object) -> tuple[str, ...]:
        raise ValueError("no")

    ground = examine._ground(read_trial(folder_of(folder / "trials", 0)))
    monkeypatch.setattr(
        examine, "rival_named", lambda name: type("R", (), {"answer": staticmethod(breaks)})
    )
    assert examine._answer("any", ground, 1.0)["error"] == "ValueError: no"


def test_a_missing_package_is_said_before_anything_begins(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys
) -> None:
    monkeypatch.setattr(trials, "MAKER", "no_such_package.trials")
    status, out, err = run(capsys, "--trials", 1, "--seed", 1, "--out", tmp_path / "out")
    assert (status, out) == (1, "") and "expected the package pendulum_bridge" in err
    assert not (tmp_path / "out").exists()
    monkeypatch.setattr(sparse_regression, "PACKAGE", "no_such_package")
    with pytest.raises(BadInputError, match="leave out --rivals"):
        sparse_regression.check_installed()


def test_what_the_maker_complains_about_is_told(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match="no_such_kind"):
        list(trial_folders(tmp_path, 1, ["--seed", "1", "--kinds", "no_such_kind:1"]))


def test_trials_that_are_there_are_not_made_again(folder: Path) -> None:
    assert [one.name for one in trial_folders(folder / "trials", 2, ["--no-such-option"])] == [
        "trial_0000",
        "trial_0001",
    ]
    assert stretches([0, 1, 2, 5, 7, 8]) == [(0, 2), (5, 5), (7, 8)]


def test_a_real_trial_is_made_and_read(tmp_path: Path) -> None:
    arguments = ["--seed", "3", "--effects", "cart_coulomb_friction", "--seconds", "40"]
    (one,) = trial_folders(tmp_path, 1, arguments)
    seal = read_trial(one)
    assert (seal.kind, list(seal.effects)) == ("single", ["cart_coulomb_friction"])
    assert list(make_true_twin(seal).effects) == ["cart_coulomb_friction"]
    assert seal.bag.is_dir() and seal.twin.is_file()


def test_a_folder_that_is_no_trial(tmp_path: Path) -> None:
    with pytest.raises(
        BadInputError, match=r"trial\.json: expected a trial with schema pendulum_trial/1"
    ):
        read_trial(tmp_path)


def test_a_recording_that_cannot_be_read_is_unusable_and_not_the_end(tmp_path: Path) -> None:
    one = recorded(tmp_path / "trial_0000", {}, seed=1, seconds=8.0)
    for path in (one / "bag").iterdir():
        path.unlink()
    found = examine._diagnosed(read_trial(one))
    assert found["verdict"]["outcome"] == "unusable" and found["error"] == ""


def test_a_proof_that_is_broken_off_leaves_no_process(folder: Path) -> None:
    before = set(multiprocessing.active_children())

    def folders():
        yield folder_of(folder / "trials", 0)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        examine_trials(folders(), (), 1, lambda one: None)
    for child in set(multiprocessing.active_children()) - before:
        child.join(10.0)
        assert child.exitcode is not None


def test_the_keyboard_stops_it_and_what_is_judged_stays(folder: Path, tmp_path: Path) -> None:
    """The maker and the processes that examine are stopped along with it."""
    out = tmp_path / "out"
    command = [
        sys.executable,
        "-m",
        "pendulum_sysid.cli",
        "prove",
        "--trials",
        "50",
        "--seed",
        "1",
    ]
    command += ["--kinds", "nothing:1", "--seconds", "40", "--processes", "1", "--out", str(out)]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    ) as program:
        assert program.stderr is not None
        line = program.stderr.readline()
        program.send_signal(signal.SIGINT)
        rest = program.communicate(timeout=90)[1]
    assert line.startswith("1/50 trial_") and program.returncode == 130
    assert "stopped by the keyboard" in rest and "Traceback" not in rest
    assert list(out.glob("trials/trial_*/examined.json"))


def test_a_plan_may_grow_but_not_change(tmp_path: Path) -> None:
    claim_folder(Plan(2, 1), tmp_path)
    claim_folder(Plan(20, 1, rivals=("all_at_once",), processes=1), tmp_path)
    with pytest.raises(BadInputError, match="pole_counts"):
        claim_folder(Plan(2, 1, pole_counts=1024), tmp_path)
    (tmp_path / "plan.json").write_text("[]")
    with pytest.raises(BadInputError, match="expected the plan of a proof"):
        claim_folder(Plan(2, 1), tmp_path)


def test_every_rival_says_what_it_is() -> None:
    assert len({one.name for one in RIVALS}) == len(RIVALS) == 3
    assert all(one.sentence for one in RIVALS)
    assert {one.right for one in NamesOutcome} == {True, False}
