"""The proof as it runs: trials are recorded, examined in processes of their own, and written."""

import json
import multiprocessing
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from support.engine_tasks import end_process
from support.prove_trials import write_trial

from pendulum_sysid.cli import main
from pendulum_sysid.fleet.engine import Engine
from pendulum_sysid.studies.proof import examine_trial, record_trial, workers
from pendulum_sysid.studies.proof.examine_trial import prepare_ground, run_diagnosis, run_rival
from pendulum_sysid.studies.proof.oracle_fit import make_true_twin
from pendulum_sysid.studies.proof.plan import Plan, claim_folder
from pendulum_sysid.studies.proof.read_trial import read_trial
from pendulum_sysid.studies.proof.record_trial import locate_trial
from pendulum_sysid.studies.proof.records import NamesOutcome
from pendulum_sysid.studies.proof.rivals import RIVALS, all_at_once, find_rival, sparse_regression
from pendulum_sysid.studies.proof.rivals.ground import Ground
from pendulum_sysid.studies.proof.workers import examine_trials
from pendulum_twin.effects import BY_NAME
from pendulum_twin.errors import BadInputError, WorkerError

COULOMB = {"cart_coulomb_friction": {"level_n": 0.5}}
DEADLINE_S = 300.0


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder in which two trials have been recorded, and none examined."""
    folder = tmp_path_factory.mktemp("proof")
    for number, effects in enumerate((COULOMB, {})):
        trial = locate_trial(folder / "trials", number)
        write_trial(trial, effects, seed=number + 1)
    return folder


@pytest.fixture(scope="module")
def ground(folder: Path) -> Ground:
    return prepare_ground(read_trial(locate_trial(folder / "trials", 0)))


def run_prove(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str, str]:
    status = main(["prove", *map(str, arguments)])
    output = capsys.readouterr()
    return status, output.out, output.err


def test_a_small_proof(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ("--trials", 2, "--processes", 1, "--out", folder, "--seed")
    status, out, err = run_prove(capsys, *arguments, 1)
    assert status == 0
    assert "2/2" in err and out.splitlines()[-1] == str(folder / "proof.html")
    proof = json.loads((folder / "proof.json").read_text())
    assert [trial["judged"]["how"] for trial in proof["trials"]] == ["right", "right"]
    trial = proof["trials"][0]
    (level,) = [s for s in trial["sizes"] if s["owner"] == "cart_coulomb_friction"]
    assert level["true"] == 0.5 and level["relative_error"] < 0.05
    assert 0.8 < trial["held_out"]["ratio"] < 1.2
    assert "<html" in (folder / "proof.html").read_text()
    before = {path: path.stat().st_mtime_ns for path in folder.glob("trials/*/examined.json")}
    assert run_prove(capsys, *arguments, 1)[0] == 0
    assert len(before) == 2 and {path: path.stat().st_mtime_ns for path in before} == before
    status, _, err = run_prove(capsys, *arguments, 2)
    assert status == 1
    assert "expected the proof that began there with seed = 1, found seed = 2" in err


def test_sparse_regression_finds_plain_friction(ground: Ground) -> None:
    pytest.importorskip(sparse_regression.PACKAGE)
    named = find_rival("sparse_regression").name_effects(ground)
    assert {"cart_coulomb_friction", "cart_stribeck_friction"} & set(named)


def test_one_fit_of_all_terms_finds_an_effect_among_terms_that_the_recording_tells_apart(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of the whole catalogue it names none or any: a change of 1e-12 at the start decides."""
    terms = (
        "cart_coulomb_friction",
        "cart_quadratic_drag",
        "rail_tilt",
        "pole_coulomb_friction",
        "pole_quadratic_drag",
        "angle_offset",
    )
    monkeypatch.setattr(all_at_once, "list_terms", lambda ground: [BY_NAME[n] for n in terms])
    write_trial(tmp_path, {"pole_coulomb_friction": {"level_n_m": 0.002}}, seed=1, seconds=18.0)
    named = find_rival("all_at_once").name_effects(prepare_ground(read_trial(tmp_path)))
    assert named == ("pole_coulomb_friction",)


def test_a_rival_that_breaks_off_is_an_answer(
    ground: Ground, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Broken:
        @staticmethod
        def name_effects(ground: Ground) -> tuple[str, ...]:
            raise ValueError("no")

    monkeypatch.setattr(examine_trial, "find_rival", lambda name: Broken)
    result = run_rival("any", ground, 1.0)
    assert result["error"] == "ValueError: no" and result["named"] == []
    assert result["seconds"] >= 1.0


def test_a_missing_package_is_reported_before_anything_begins(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(record_trial, "PACKAGE", "no_such_package")
    status, out, err = run_prove(capsys, "--trials", 1, "--seed", 1, "--out", tmp_path / "out")
    assert (status, out) == (1, "") and "expected the package no_such_package" in err
    assert not (tmp_path / "out").exists()
    monkeypatch.setattr(sparse_regression, "PACKAGE", "no_such_package")
    with pytest.raises(BadInputError, match="leave out --rivals"):
        sparse_regression.check_installed()


def test_a_complaint_of_the_recorder_is_passed_on(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match="no_such_kind"):
        record_trial.record_trial(tmp_path, 0, ["--seed", "1", "--kinds", "no_such_kind:1"])
    with pytest.raises(BadInputError, match=r"no_such_twin\.yaml"):
        record_trial.record_trial(tmp_path, 0, ["--seed", "1", "--twin", "no_such_twin.yaml"])


@pytest.mark.parametrize(
    "words, expected, begins",
    [
        (("--kinds", "foo:1"), 2, "sysid: --kinds: expected KIND:SHARE,..."),
        (("--seconds", "3"), 2, "sysid: --seconds: expected a number from 40"),
        (("--twin", "nope.yaml"), 1, "sysid: nope.yaml: expected a twin file"),
        (("--twin", "nope.yaml", "--degrade"), 1, "sysid: nope.yaml: expected a twin file"),
    ],
)
def test_what_the_recorder_refuses_is_said_before_anything_is_written(
    words: tuple[str, ...],
    expected: int,
    begins: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    out = tmp_path / "out"
    status, _, err = run_prove(capsys, "--trials", 1, "--seed", 1, "--out", out, *words)
    assert (status, out.exists()) == (expected, False)
    assert err.startswith(begins) and err.count("expected") == 1


def test_the_nominal_rig_needs_no_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)  # outside the clone
    record_trial.check_options(["--seed", "1"])
    assert not list(tmp_path.iterdir())


def test_a_trial_that_is_there_is_not_recorded_again(folder: Path) -> None:
    trials = folder / "trials"
    assert record_trial.record_trial(trials, 1, ["--no-such-option"]) == trials / "trial_0001"


def test_an_emulated_trial_is_recorded_and_read(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = ["--seed", "3", "--effects", "cart_coulomb_friction", "--seconds", "40"]
    trial = read_trial(record_trial.record_trial(tmp_path, 0, options))
    assert (trial.kind, list(trial.seal.effects)) == ("single", ["cart_coulomb_friction"])
    assert list(make_true_twin(trial).effects) == ["cart_coulomb_friction"]
    assert trial.bag.is_dir() and trial.twin.is_file()
    assert capsys.readouterr().out == ""


def test_a_folder_that_is_no_trial(tmp_path: Path) -> None:
    expected = r"trial\.json: expected a trial with schema pendulum_trial/1"
    with pytest.raises(BadInputError, match=expected):
        read_trial(tmp_path)


def test_a_seal_that_lacks_the_rig(tmp_path: Path) -> None:
    trial = write_trial(tmp_path / "trial_0000", {}, seed=1, seconds=8.0)
    (trial / "seal.json").write_text('{"schema": "pendulum_seal/1", "effects": {}}')
    with pytest.raises(BadInputError, match=r"seal\.json: expected a seal with effects and rig"):
        read_trial(trial)


def test_a_recording_that_cannot_be_read_is_unusable_and_not_the_end(tmp_path: Path) -> None:
    trial = write_trial(tmp_path / "trial_0000", {}, seed=1, seconds=8.0)
    remove_files(trial / "bag")
    result = run_diagnosis(read_trial(trial))
    assert result["verdict"]["outcome"] == "unusable" and result["error"] == ""


def remove_files(folder: Path) -> None:
    for path in folder.iterdir():
        path.unlink()


def break_off(trial: Path) -> None:
    raise KeyboardInterrupt


def test_a_proof_that_is_broken_off_leaves_no_process(folder: Path, tmp_path: Path) -> None:
    before = set(multiprocessing.active_children())
    trials = tmp_path / "trials"
    for number in range(2):
        write_trial(locate_trial(trials, number), {}, seed=1, seconds=8.0)
    remove_files(locate_trial(trials, 0) / "bag")  # ends at once, while the next is worked on
    with pytest.raises(KeyboardInterrupt):
        examine_trials(trials, 2, (), (), Engine(workers=1), break_off)
    deadline = time.monotonic() + DEADLINE_S
    for child in set(multiprocessing.active_children()) - before:
        child.join(deadline - time.monotonic())
        assert child.exitcode is not None


def test_a_worker_that_dies_ends_the_proof_with_a_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Not bad input: the machinery broke, and the same command goes on."""
    monkeypatch.setattr(workers, "_record_and_examine", end_process)
    arguments = ("--trials", 1, "--seed", 1, "--processes", 1, "--out", tmp_path / "out")
    status, out, err = run_prove(capsys, *arguments)
    assert (status, out) == (1, "") and err.startswith("sysid: a process that examined trials")
    assert "run the same command again" in err
    assert not issubclass(WorkerError, BadInputError)


def test_the_keyboard_stops_it_and_examined_trials_stay(tmp_path: Path) -> None:
    """The processes that record and examine are stopped along with it."""
    out = tmp_path / "out"
    write_trial(locate_trial(out / "trials", 0), {}, seed=1, seconds=8.0)  # soon examined
    command = [sys.executable, "-m", "pendulum_sysid.cli", "prove", "--trials", "50"]
    command += ["--seed", "1", "--kinds", "nothing:1", "--seconds", "40", "--processes", "1"]
    with subprocess.Popen(
        [*command, "--out", str(out)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=restore_interrupts,
    ) as program:
        assert program.stderr is not None
        line = program.stderr.readline()
        program.send_signal(signal.SIGINT)
        messages = program.communicate(timeout=DEADLINE_S)[1]
    assert line.startswith("1/50 trial_") and program.returncode == 130
    assert "stopped by the keyboard" in messages and "Traceback" not in messages
    assert list(out.glob("trials/trial_*/examined.json"))


def restore_interrupts() -> None:
    """Undo a parent's SIG_IGN, as nohup leaves it: Python then never raises KeyboardInterrupt."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


def test_a_plan_may_grow_but_not_change(tmp_path: Path) -> None:
    claim_folder(Plan(2, 1), tmp_path)
    claim_folder(Plan(20, 1, rivals=("all_at_once",), processes=1), tmp_path)
    with pytest.raises(BadInputError, match="pole_counts"):
        claim_folder(Plan(2, 1, pole_counts=1024), tmp_path)
    for tries in (2, 0, 2):  # a dose-response may be added, left out, and gone on with
        claim_folder(Plan(2, 1, dose_tries=tries), tmp_path)
    claim_folder(Plan(2, 1), tmp_path)
    with pytest.raises(BadInputError, match="dose_tries = 2, found dose_tries = 4"):
        claim_folder(Plan(2, 1, dose_tries=4), tmp_path)
    (tmp_path / "plan.json").write_text("[]")
    with pytest.raises(BadInputError, match="expected the plan of a proof"):
        claim_folder(Plan(2, 1), tmp_path)


def test_a_proof_of_an_earlier_version_goes_on(tmp_path: Path) -> None:
    claim_folder(Plan(2, 1), tmp_path)
    plan = json.loads((tmp_path / "plan.json").read_text())
    del plan["relay"]  # an option that the earlier version did not have
    (tmp_path / "plan.json").write_text(json.dumps(plan))
    with pytest.raises(BadInputError, match="relay = False, found relay = True"):
        claim_folder(Plan(2, 1, relay=True), tmp_path)
    claim_folder(Plan(2, 1), tmp_path)


def test_a_twin_is_known_by_its_content_and_not_by_its_path(tmp_path: Path) -> None:
    twin, copy, folder = (tmp_path / name for name in ("twin.yaml", "copy.yaml", "proof"))
    twin.write_text("a twin")
    copy.write_text("a twin")
    claim_folder(Plan(2, 1, twin=str(twin)), folder)
    claim_folder(Plan(2, 1, twin=str(copy)), folder)
    twin.write_text("another twin")
    with pytest.raises(BadInputError, match=r"copy.yaml\), found another content in .*twin.yaml"):
        claim_folder(Plan(2, 1, twin=str(twin)), folder)
    with pytest.raises(BadInputError, match="found twin = None"):
        claim_folder(Plan(2, 1), folder)
    plan = json.loads((folder / "plan.json").read_text())
    del plan["twin_digest"]  # of an earlier version, which kept the path alone
    (folder / "plan.json").write_text(json.dumps(plan))
    with pytest.raises(BadInputError, match="found twin ="):
        claim_folder(Plan(2, 1, twin=str(twin)), folder)
    claim_folder(Plan(2, 1, twin=str(copy)), folder)


def test_every_rival_says_what_it_is() -> None:
    assert len({rival.name for rival in RIVALS}) == len(RIVALS) == 3
    assert all(rival.sentence for rival in RIVALS)
    assert {outcome.is_right for outcome in NamesOutcome} == {True, False}
