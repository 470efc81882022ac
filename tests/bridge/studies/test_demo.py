"""The demo records a concealed rig; each failure of the demo is one sentence."""

import json
import os
import re
import shutil
import signal
import subprocess
from contextlib import suppress
from pathlib import Path

import pytest
from support.paths import CONFIG, ROOT
from support.polling import until
from support.verdicts import make_missing_entry, make_verdict

from pendulum_bridge.studies import demo
from pendulum_bridge.studies.demo_folder import DemoFacts, make_room, write_facts
from pendulum_bridge.studies.lost_samples import SamplesLostError
from pendulum_sysid.reading.bag import read_bag

PLAN = "schema: pendulum_plan/1\nrate_hz: 100\nphases: [{kind: push}, {kind: rest, seconds: 1}]\n"
TWIN = CONFIG / "inteco.yaml"


def test_the_demo_runs_from_concealing_to_the_answer(tmp_path, monkeypatch, capsys) -> None:
    calls = []

    def write_verdict(arguments: list[str]) -> int:
        """Stand in for the diagnosis, which takes long."""
        verb, recording, _, twin, _, out, *topic = arguments
        calls.append((verb, arguments[2], arguments[4], topic))
        assert Path(recording, "metadata.yaml").is_file() and Path(twin).is_file()
        Path(out).mkdir()
        verdict = make_verdict(make_missing_entry("rail_tilt"))
        Path(out, "verdict.json").write_text(json.dumps(verdict))
        return 0

    monkeypatch.setattr(demo, "run_sysid", write_verdict)
    (tmp_path / "plan.yaml").write_text(PLAN)
    out = tmp_path / "out"
    options = ["--seed", "3", "--twin", str(TWIN), "--plan", str(tmp_path / "plan.yaml")]
    (out / "seal.json").parent.mkdir()
    for name in ("nominal_twin.yaml", "seal.json"):  # an earlier demo's
        (out / name).write_text("precious")
    assert demo.main(["--out", str(out), *options]) == 0
    assert (tmp_path / "out_seed_unknown" / "seal.json").read_text() == "precious"
    assert calls == [("diagnose", "--twin", "--out", ["--command-topic", "/rig/applied_pwm"])]
    output = capsys.readouterr().out
    again = f"--seed 3 --effects 1 --twin {TWIN} --plan {tmp_path / 'plan.yaml'}"
    assert output.endswith(f'Again: make demo ARGS="{again}"\n')
    assert (
        f"kept in {tmp_path / 'out_seed_unknown'}" in output
        and str(out / "diagnosis" / "report.html") in output
    )
    assert "rail_tilt: was not concealed" in output and "The diagnosis is wrong" in output
    names = {"seal.json", "recording", "nominal_twin.yaml", "diagnosis", "logs", "demo.json"}
    assert {path.name for path in out.iterdir()} == names
    recording = read_bag(out / "recording", command_topic=demo.APPLIED_TOPIC)
    assert recording.state_stamp_s[-1] > 2
    assert max(abs(recording.command)) == pytest.approx(0.3)


def test_a_plan_that_a_busy_computer_gives_up_is_recorded_once_more(
    tmp_path, monkeypatch, capsys
) -> None:
    out, tried = tmp_path / "out", []

    def record(options, nominal, seed) -> None:
        assert not (options.out / "recording").exists(), "nothing of the first is left"
        tried.append(seed)
        for folder in ("recording", "logs"):
            (options.out / folder).mkdir(parents=True)
        (options.out / "seal.json").write_text("{}")
        raise demo.PlanGivenUpError("excitation_node ended with status 1")

    monkeypatch.setattr(demo, "record", record)
    assert demo.main(["--out", str(out), "--twin", str(TWIN), "--seed", "4"]) == 1
    said = capsys.readouterr().err.splitlines()
    assert tried == [4, 4] and "recording once more" in said[0]
    assert said[1] == "demo: excitation_node ended with status 1"


@pytest.mark.parametrize("calm_later", [True, False])
def test_a_recording_that_a_busy_computer_spoils_is_made_once_more_and_told(
    calm_later: bool, tmp_path, monkeypatch, capsys
) -> None:
    out, tried = tmp_path / "out", []

    def record(options, nominal, seed) -> None:
        assert not (options.out / "recording").exists(), "nothing of the first is left"
        tried.append(seed)
        (options.out / "recording").mkdir()
        if not (calm_later and len(tried) == 2):
            raise SamplesLostError(f"{len(tried)}0 % of the samples were lost")

    monkeypatch.setattr(demo, "record", record)
    monkeypatch.setattr(demo, "diagnose", lambda out, quiet: None)
    monkeypatch.setattr(demo, "format_answer", lambda out, nominal: "the answer")
    assert demo.main(["--out", str(out), "--twin", str(TWIN), "--seed", "4"]) == 0
    shown = capsys.readouterr()
    said = shown.err.splitlines()
    assert tried == [4, 4] and "the answer" in shown.out
    assert said[0] == "demo: 10 % of the samples were lost; recording once more"
    assert said[1:] == ([] if calm_later else [
        "demo: 20 % of the samples were lost: let it come to rest before you judge the diagnosis"
    ])  # fmt: skip


def test_a_failed_diagnosis_is_one_sentence(tmp_path, monkeypatch, capsys) -> None:
    def record_nothing(options, nominal, seed) -> None:
        (options.out / "recording").mkdir(parents=True)
        (options.out / "nominal_twin.yaml").write_bytes(TWIN.read_bytes())

    monkeypatch.setattr(demo, "record", record_nothing)
    assert demo.main(["--out", str(tmp_path / "out"), "--twin", str(TWIN)]) == 1
    first, last = capsys.readouterr().err.splitlines()[-2:]
    assert first.startswith("sysid: ") and "recording" in first
    assert last == "demo: sysid diagnose ended with status 1; what it said stands above"


def test_a_folder_with_other_files_is_left_alone(tmp_path, capsys) -> None:
    (tmp_path / "thesis.pdf").write_text("precious")
    assert demo.main(["--out", str(tmp_path), "--twin", str(TWIN)]) == 1
    assert "expected an empty folder or an earlier demo's" in capsys.readouterr().err
    assert (tmp_path / "thesis.pdf").read_text() == "precious"


def test_a_file_in_place_of_the_folder_is_left_alone(tmp_path, capsys) -> None:
    (tmp_path / "out").write_text("precious")
    assert demo.main(["--out", str(tmp_path / "out"), "--twin", str(TWIN)]) == 1
    assert "--out: expected a folder, found the file" in capsys.readouterr().err
    assert (tmp_path / "out").read_text() == "precious"


def test_earlier_demos_are_kept_under_their_seeds(tmp_path: Path) -> None:
    out = tmp_path / "demo"
    assert make_room(out) is None
    for name in ("demo_seed_7", "demo_seed_7_2", "demo_seed_7_3"):
        out.mkdir()
        (out / "nominal_twin.yaml").write_text(name)
        write_facts(DemoFacts(7, 1, ("--effects", "1")), out)
        assert make_room(out) == tmp_path / name
        assert (tmp_path / name / "nominal_twin.yaml").read_text() == name
    assert not out.exists()


def leave_make() -> dict[str, str]:
    """Return the environment without what a make around this test run has put there."""
    left_out = {"ROS_DISTRO", "MAKELEVEL", "MAKEFLAGS", "MFLAGS", "ARGS"}
    return {name: value for name, value in os.environ.items() if name not in left_out}


INTERRUPTED = """#!/bin/bash
close_down() {
  until [ -e "$(dirname "$0")/may_end" ]; do sleep 0.05; done
  echo "demo: interrupted" >&2
  exit 130
}
trap close_down INT
echo runs
while :; do sleep 0.05; done
"""


def has_taken(pid: int, sent: signal.Signals) -> bool:
    """Return whether the process has no such signal left to take."""
    status = Path(f"/proc/{pid}/status").read_text()
    waiting = re.search(r"^ShdPnd:\s*(\w+)$", status, re.MULTILINE)
    assert waiting is not None
    return not int(waiting[1], 16) >> (sent - 1) & 1


@pytest.mark.skipif(shutil.which("make") is None, reason="needs make")
def test_after_ctrl_c_make_has_nothing_to_add(tmp_path: Path) -> None:
    python = tmp_path / "python"
    python.write_text(INTERRUPTED)
    python.chmod(0o755)
    command = ["make", f"BIN={tmp_path}", "-o", ".venv/.installed-wheels", "demo"]
    made = subprocess.Popen(
        command,
        cwd=ROOT,
        env=leave_make(),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    try:
        assert made.stdout is not None
        assert made.stdout.readline() == "runs\n"
        os.killpg(made.pid, signal.SIGINT)  # as a terminal does
        # GNU make complains of a child that ended before make took the signal; a demo takes
        # longer to close down than that.
        until(lambda: has_taken(made.pid, signal.SIGINT), "make to take the signal")
        (tmp_path / "may_end").touch()
        _, said = made.communicate(timeout=60)
        assert said == "demo: interrupted\n"
    finally:
        with suppress(ProcessLookupError):
            os.killpg(made.pid, signal.SIGKILL)
        made.wait()


@pytest.mark.skipif(shutil.which("make") is None, reason="needs make")
def test_a_demo_that_fails_is_an_error_of_make(tmp_path: Path) -> None:
    python = tmp_path / "python"
    python.write_text("#!/bin/bash\nexit 1\n")
    python.chmod(0o755)
    command = ["make", f"BIN={tmp_path}", "-o", ".venv/.installed-wheels", "demo"]
    made = subprocess.run(command, cwd=ROOT, env=leave_make(), capture_output=True, check=False)
    assert made.returncode == 2
