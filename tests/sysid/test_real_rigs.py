"""Recordings of real rigs, made by others: what the tool says of them, through the command line."""

import json
from pathlib import Path

import pytest

from pendulum_sysid.cli import main
from pendulum_twin.model import Twin, load_twin, save_twin
from pendulum_twin.rig import Rig


def diagnosed(bags: list[Path], twin: Path, out: Path) -> dict:
    assert main(["diagnose", *map(str, bags), "--twin", str(twin), "--out", str(out)]) == 0
    assert (out / "report.html").stat().st_size > 0 and load_twin(out / "twin.yaml")
    return json.loads((out / "verdict.json").read_text())


def imported(csv: Path, out: Path, *columns: str) -> Path:
    assert main(["import", str(csv), "--out", str(out), *columns]) == 0
    return out


def names(verdict: dict) -> list[str]:
    return [one["effect"] for one in verdict["missing_physics"]]


def test_the_thesis_s_rig(shared_data: Path, tmp_path: Path) -> None:
    """A wrong sign and dry friction; what a careful reader of the data knows not to be there is not named."""
    folder = shared_data / "inteco_rig"
    found = diagnosed([folder / "open_loop_0_60s"], folder / "twin.yaml", tmp_path / "out")
    assert found["outcome"] == "named"
    dry = {"cart_coulomb_friction", "cart_stribeck_friction", "cart_saturating_friction"}
    assert "cart_sign_inverted" in names(found) and dry & set(names(found))
    assert {"input_delay", "motor_lag", "input_dead_zone", "rail_tilt"}.isdisjoint(names(found))
    assert found["fit"]["held_out_cart_mm"]["after"] <= 7.5
    assert found["fit"]["held_out_pole_rad"]["after"] <= 0.027
    assert any(
        line.startswith("cart_viscous_n_s_m had absorbed the missing") for line in found["masking"]
    )
    assert {"wrap", "spike"} <= {one["kind"] for one in found["data_quality"]}
    assert found["remainder"]["above_noise_floor"] > 2


def test_a_rig_whose_recordings_begin_before_its_drive_does(
    shared_data: Path, tmp_path: Path
) -> None:
    columns = (
        "--time",
        "t",
        "--command",
        "u_applied",
        "--cart",
        "x",
        "--pole",
        "theta",
        "--pole-zero",
        "down",
    )
    files = sorted((shared_data / "quanser_cartpole" / "chirp").glob("*.csv"))
    bags = [imported(file, tmp_path / file.stem, *columns) for file in files]
    found = diagnosed(bags, shared_data / "quanser_cartpole" / "twin.yaml", tmp_path / "out")
    stale = [
        span
        for one in found["data_quality"]
        if one["kind"] == "stale"
        for span in one["intervals_s"]
    ]
    assert len(stale) == len(files) == 5
    assert all(0.4 < end - begin < 0.7 for begin, end in stale)
    cart = found["fit"]["held_out_cart_mm"]
    assert cart["after"] < cart["before"] / 3
    assert {"input_delay", "input_dead_zone"}.isdisjoint(
        names(found)
    )  # what the dead starts look like


def test_a_cart_alone(shared_data: Path, tmp_path: Path) -> None:
    bag = imported(
        shared_data / "emps" / "emps_estimation.csv",
        tmp_path / "bag",
        "--time",
        "t",
        "--command",
        "vir",
        "--cart",
        "qm",
    )
    save_twin(
        Twin("emps", Rig(cart_mass_kg=100.0, force_per_pwm_n=35.1507, cart_viscous_n_s_m=100.0)),
        tmp_path / "twin.yaml",
    )
    found = diagnosed([bag], tmp_path / "twin.yaml", tmp_path / "out")
    (friction,) = [
        one for one in found["missing_physics"] if one["effect"] == "cart_coulomb_friction"
    ]
    assert 18.0 < friction["parameters"]["level_n"]["value"] < 27.0
    assert (
        friction["parameters"]["level_n"]["unit"] == "N" and friction["cannot_be_told_from"] == []
    )
    assert (
        found["fit"]["held_out_cart_mm"]["after"]
        < 0.1 * found["fit"]["held_out_cart_mm"]["before"]
    )


def test_a_pole_alone_without_command(shared_data: Path, tmp_path: Path) -> None:
    bag = imported(
        shared_data / "multiarm_free_swing" / "single_free_swing_id.csv",
        tmp_path / "bag",
        "--time",
        "t",
        "--pole",
        "theta",
    )
    mass, length = 0.147585, 0.147755
    rig = Rig(
        pole_mass_kg=mass,
        com_distance_m=length,
        pole_inertia_kg_m2=1.0912e-4 + mass * length**2,
        pole_viscous_n_m_s=2.2394e-4,
    )
    save_twin(Twin("free swing", rig), tmp_path / "twin.yaml")
    found = diagnosed([bag], tmp_path / "twin.yaml", tmp_path / "out")
    pole = found["fit"]["held_out_pole_rad"]
    assert pole["after"] < 0.5 * pole["before"]
    assert found["rig_parameters"]["com_distance_m"]["after"] == pytest.approx(length, rel=0.02)
    assert "held_out_cart_mm" not in found["fit"]
