"""What the doctor measured stands in the recording, and the diagnosis reads it."""

import json
from pathlib import Path

import numpy as np
import pytest

from pendulum_bridge.doctor.faults import Fault
from pendulum_bridge.doctor.findings import Check, Finding
from pendulum_bridge.doctor.rig_doctor import _make_mapping
from pendulum_bridge.recording.command_latency import read_command_latency
from pendulum_sysid.reading.bag import read_bag
from pendulum_sysid.reading.command_latency import read_command_latency as read_in_sysid
from pendulum_sysid.records import CommandLatency
from pendulum_twin.bags.write import Commands, States, write_recording
from pendulum_twin.errors import BadInputError

LATENCY = {"mean_s": 0.0123, "spread_s": 0.0021, "steps": 9}


def make_report(**figures: float) -> str:
    """Return what the doctor prints with --json."""
    findings = [
        Finding(Check.SAMPLES, "samples", "none", Fault.SILENT),
        Finding(Check.LATENCY, "at most 20 ms", "12 ms", figures=figures),
    ]
    return json.dumps(_make_mapping(findings))


def write_with(folder: Path, custom: dict[str, str]) -> None:
    stamps, cart = 10_000_000 * np.arange(300), np.linspace(0, 1, 300)
    states = States("/rig/joint_states", stamps, ("cart",), cart[:, None])
    write_recording(folder, states, Commands("/rig/pwm", stamps, cart), custom)


def test_the_doctors_figures_reach_the_recording(tmp_path: Path) -> None:
    write_with(tmp_path / "bag", read_command_latency(make_report(**LATENCY), "doctor.json"))
    assert read_bag(tmp_path / "bag").command_latency == CommandLatency(0.0123, 0.0021)


def test_without_a_measured_latency_nothing_is_said(tmp_path: Path) -> None:
    custom = read_command_latency(make_report(), "doctor.json")
    assert custom == {}
    write_with(tmp_path / "bag", custom)
    assert read_bag(tmp_path / "bag").command_latency is None


def test_a_spread_may_be_unknown() -> None:
    custom = read_command_latency(make_report(mean_s=0.01), "doctor.json")
    assert read_in_sysid(custom) == CommandLatency(0.01, None)


@pytest.mark.parametrize(
    "report",
    ["", "[]", "{}", '{"schema": "other/1", "findings": []}', "[" * 100_000,
     '{"schema": "rig_doctor/1", "findings": [{"figures": {}}]}',
     json.dumps(json.loads(make_report(mean_s=1.0))).replace("1.0", "NaN")],
)  # fmt: skip
def test_another_file_is_refused_in_a_sentence(report: str) -> None:
    with pytest.raises(BadInputError, match=r"rig_doctor --move --json printed, found another"):
        read_command_latency(report, "doctor.json")


@pytest.mark.parametrize(
    "text",
    ["", "null", "[]", '{"mean_s": "soon"}', '{"mean_s": -1}', '{"mean_s": NaN}', "[" * 9999],
)
def test_a_damaged_entry_counts_as_none(text: str) -> None:
    assert read_in_sysid({"command_latency": text}) is None
    assert read_in_sysid({"command_latency": 3}) is None
