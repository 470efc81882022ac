"""An earlier diagnosis is read back, or refused in words of a verdict."""

import json
import math
from dataclasses import replace
from pathlib import Path

import pytest
from support.made_recordings import INTECO

from pendulum_sysid.errors import FileError, WrongUse
from pendulum_sysid.reading.earlier_verdict import check_recordings, read_verdict
from pendulum_twin.laws.law import Law
from pendulum_twin.model import save_twin


def write(folder: Path, **changes: object) -> Path:
    missing = [{"effect": "motor_lag", "cannot_be_told_from": ["input_delay"]}]
    verdict = {"schema": "pendulum_verdict/1", "outcome": "named", "missing_physics": missing}
    path = folder / "verdict.json"
    path.write_text(json.dumps(verdict | changes))
    save_twin(INTECO, folder / "twin.yaml")
    return path


def test_the_rivals_of_each_effect_are_read(tmp_path: Path) -> None:
    earlier = read_verdict(write(tmp_path))
    assert earlier.rivals == {"motor_lag": ("input_delay",)} and earlier.twin == INTECO


def test_the_intervals_of_all_parameters_are_read(tmp_path: Path) -> None:
    lag = {"time_constant_s": {"value": 0.04, "low": 0.03, "high": 0.05, "unit": "s"}}
    missing = [{"effect": "motor_lag", "cannot_be_told_from": [], "parameters": lag}]
    tilt = {"angle_rad": {"value": 0.01, "low": None, "high": 0.02, "unit": "rad"}}
    path = write(
        tmp_path,
        missing_physics=missing,
        perhaps=[{"effect": "rail_tilt", "parameters": tilt}, 3],
        rig_parameters={"cart_viscous_n_s_m": {"after": 0.5, "low": 0.4, "high": 0.6}, "odd": 3},
        effect_parameters={"input_delay.delay_s": {"low": 0.001, "high": 0.002}},
    )
    intervals = read_verdict(path).intervals
    assert intervals["motor_lag.time_constant_s"] == (0.03, 0.05)
    assert intervals["rail_tilt.angle_rad"] == pytest.approx((math.nan, 0.02), nan_ok=True)
    assert intervals["cart_viscous_n_s_m"] == (0.4, 0.6)
    assert intervals["input_delay.delay_s"] == (0.001, 0.002)


def test_the_bands_of_the_laws_are_read(tmp_path: Path) -> None:
    force = {"law": "cart_force_by_position", "low": [0.0, 0.1], "high": [0.2, 0.5]}
    odd = [{"law": "drive_gain_along_rail", "low": [0.0], "high": [0.1, 0.2]}, {"low": [0.0]}, 3]
    bands = read_verdict(write(tmp_path, measured_laws=[force, *odd])).bands
    assert {law: band.tolist() for law, band in bands.items()} == {
        "cart_force_by_position": pytest.approx([0.1, 0.2])
    }


def test_a_rig_that_changed_is_read(tmp_path: Path) -> None:
    assert read_verdict(write(tmp_path, rig_changed=True)).rig_changed
    assert not read_verdict(write(tmp_path)).rig_changed


def test_a_tie_is_that_of_twins_without_laws(tmp_path: Path) -> None:
    law = Law((0.0, 0.5, 1.0), (0.0, 0.1, 0.2))
    path = write(tmp_path)
    save_twin(
        replace(INTECO, measured_laws={"cart_force_by_position": law}), tmp_path / "twin.yaml"
    )
    assert read_verdict(path).twin.measured_laws
    path.write_text(path.read_text().replace('"named"', '"ambiguous"'))
    assert not read_verdict(path).twin.measured_laws


def test_a_verdict_of_other_recordings_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path, recording={"digest": "sha256:a1 + sha256:b2"})
    earlier = read_verdict(path)
    with pytest.raises(WrongUse, match="found that of others: name the recordings"):
        check_recordings(path, earlier, ["sha256:c3"])
    check_recordings(path, earlier, ["sha256:b2", "sha256:c3"])  # of a part of these
    check_recordings(path, read_verdict(write(tmp_path)), ["sha256:c3"])  # names none


@pytest.mark.parametrize("outcome", ["perhaps", None, 3, ["named"]])
def test_an_outcome_that_is_none_is_refused(tmp_path: Path, outcome: object) -> None:
    with pytest.raises(
        FileError, match=r"expected an outcome \(named, .*\), found .*verdict.json"
    ):
        read_verdict(write(tmp_path, outcome=outcome))


@pytest.mark.parametrize(
    "missing",
    [
        None,
        "motor_lag",
        [3],
        {"effect": "motor_lag"},
        [{"effect": "motor_lag"}],
        [{"effect": "motor_lag", "cannot_be_told_from": "input_delay"}],
        [{"effect": "motor_lag", "cannot_be_told_from": [3]}],
        [{"effect": None, "cannot_be_told_from": []}],
    ],
)
def test_missing_physics_of_another_form_is_refused(tmp_path: Path, missing: object) -> None:
    with pytest.raises(FileError, match="expected missing_physics to be a list of effects, each"):
        read_verdict(write(tmp_path, missing_physics=missing))
