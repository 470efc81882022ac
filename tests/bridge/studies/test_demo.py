"""The demo records a concealed rig; each failure of the demo is one sentence."""

import json
from pathlib import Path

import pytest
from support.paths import CONFIG
from support.verdicts import make_missing_entry, make_verdict

from pendulum_bridge.studies import demo
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
    for _ in range(2):  # an earlier demo's folder is used again
        assert demo.main(["--out", str(out), *options]) == 0
    assert calls == 2 * [("diagnose", "--twin", "--out", ["--command-topic", "/rig/applied_pwm"])]
    output = capsys.readouterr().out
    assert "--seed 3" in output and str(out / "diagnosis" / "report.html") in output
    assert "rail_tilt: was not concealed" in output and "The diagnosis is wrong" in output
    names = {"seal.json", "recording", "nominal_twin.yaml", "diagnosis", "logs"}
    assert {path.name for path in out.iterdir()} == names
    recording = read_bag(out / "recording", command_topic=demo.APPLIED_TOPIC)
    assert recording.state_stamp_s[-1] > 2
    assert max(abs(recording.command)) == pytest.approx(0.3)


def test_a_failed_diagnosis_is_one_sentence(tmp_path, monkeypatch, capsys) -> None:
    def record_nothing(options, nominal, seed) -> None:
        (options.out / "recording").mkdir(parents=True)
        (options.out / "nominal_twin.yaml").write_bytes(TWIN.read_bytes())

    monkeypatch.setattr(demo, "record", record_nothing)
    assert demo.main(["--out", str(tmp_path / "out"), "--twin", str(TWIN)]) == 1
    first, last = capsys.readouterr().err.splitlines()
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
