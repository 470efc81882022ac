"""Recordings of several days and amplitudes together, and of a controller at work."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from support.hidden_physics import INTECO

from pendulum_bridge.studies import trials
from pendulum_sysid.cleaning.clean import clean_recording
from pendulum_sysid.pipeline import diagnose
from pendulum_sysid.reading.bag import COMMAND_TOPIC, STATE_TOPIC, read_bag
from pendulum_sysid.reading.raw import RawRecording
from pendulum_sysid.records import Recording
from pendulum_twin.model import load_twin

pytestmark = pytest.mark.long

KEPT_S = 24.0  # of each recording of 40 s: the answer is the same


def cut_recording(raw: RawRecording, seconds: float) -> RawRecording:
    """Return the beginning of a recording."""
    end_s = raw.state_stamp_s[0] + seconds
    samples, commands = raw.state_stamp_s < end_s, raw.command_stamp_s < end_s
    names = ("state_stamp_s", "cart", "pole", "cart_velocity", "pole_velocity")
    return replace(
        raw,
        command_stamp_s=raw.command_stamp_s[commands],
        command=raw.command[commands],
        state_received_s=None,
        **{name: getattr(raw, name)[samples] for name in names},
    )


def recorded(
    folder: Path, effects: str, seconds: int, seed: int, *more: str
) -> tuple[Recording, dict]:
    """Return what a concealed rig showed, and what is sealed."""
    arguments = [
        "--out",
        str(folder),
        "--trials",
        "1",
        "--seed",
        str(seed),
        "--effects",
        effects,
        "--seconds",
        str(seconds),
    ]
    assert trials.main([*arguments, *more]) == 0
    (trial,) = sorted(folder.glob("trial_*"))
    raw = cut_recording(read_bag(trial / "bag", STATE_TOPIC, COMMAND_TOPIC), KEPT_S)
    return clean_recording(raw), json.loads((trial / "seal.json").read_text())


def test_a_controller_at_work(tmp_path: Path) -> None:
    """Delay and noise are correlated with the command there."""
    recording, seal = recorded(
        tmp_path,
        "input_delay+cart_coulomb_friction",
        40,
        4,
        "--closed-loop",
        "--pole-counts",
        "1024",
    )
    found = diagnose(
        [recording], load_twin(tmp_path / "trial_0000" / "twin.yaml"), lambda line: None
    ).to_dict()
    assert {one["effect"] for one in found["missing_physics"]} == set(seal["effects"])
    for one in found["missing_physics"]:
        for name, true in seal["effects"][one["effect"]].items():
            assert one["parameters"][name]["value"] == pytest.approx(true, rel=0.05)


def test_recordings_of_one_rig_together(tmp_path: Path) -> None:
    """One rig (one seed), by the standard plan and by a controller; a drift begins anew."""
    effects = "gain_drift+cart_quadratic_drag"
    one, seal = recorded(tmp_path / "plan", effects, 40, 6)
    other, again = recorded(tmp_path / "controller", effects, 40, 6, "--closed-loop")
    assert seal == again
    found = diagnose(
        [one, other], load_twin(tmp_path / "plan" / "trial_0000" / "twin.yaml"), lambda line: None
    ).to_dict()
    assert {each["effect"] for each in found["missing_physics"]} == set(seal["effects"])
    assert found["recording"]["samples"] == len(one.signals) + len(other.signals)
    assert INTECO.rig.cart_mass_kg == seal["rig"]["cart_mass_kg"]
