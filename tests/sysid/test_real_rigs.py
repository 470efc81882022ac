"""Recordings of real rigs, made by others: what the tool says of them, by the command line.

Each rig is diagnosed once a run. The recordings are not part of the repository.
"""

import json
import subprocess
import sys
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest
from support.made_once import make_once

from pendulum_sysid.api import read_recording
from pendulum_sysid.cli import main
from pendulum_sysid.finding.detectors.detector import Sight
from pendulum_sysid.finding.detectors.steady_friction import read_friction
from pendulum_sysid.fitting.fit import fit_own_parameters
from pendulum_sysid.prepare import prepare
from pendulum_sysid.records import QualityFinding
from pendulum_twin.effects import CATALOGUE
from pendulum_twin.effects.effect import Form, Place
from pendulum_twin.model import Twin, load_twin, save_twin
from pendulum_twin.rig import Rig

pytestmark = pytest.mark.long(seconds=45)

ROOT = Path(__file__).parents[2]
DRY = {  # laws of the cart's dry friction, which a recording may not tell from each other
    effect.name for effect in CATALOGUE if effect.form is Form.DRY and effect.place is Place.CART
} | {"cart_load_friction", "cart_presliding_friction", "friction_warming"}
QUANSER_COLUMNS = (
    "--time", "t", "--command", "u_applied", "--cart", "x", "--pole", "theta",
    "--pole-zero", "down",
)  # fmt: skip
EMPS_RIG = Rig(cart_mass_kg=100.0, force_per_pwm_n=35.1507, cart_viscous_n_s_m=100.0)
SWING_MASS_KG, SWING_LENGTH_M = 0.147585, 0.147755
SWING_RIG = Rig(
    pole_mass_kg=SWING_MASS_KG,
    com_distance_m=SWING_LENGTH_M,
    pole_inertia_kg_m2=1.0912e-4 + SWING_MASS_KG * SWING_LENGTH_M**2,
    pole_viscous_n_m_s=2.2394e-4,
)


@dataclass(frozen=True)
class Diagnosed:
    """Hold the verdict on a rig as verdict.json has it."""

    verdict: dict[str, Any]

    @property
    def names(self) -> list[str]:
        return [effect["effect"] for effect in self.verdict["missing_physics"]]

    def get_held_out(self, unit: str) -> dict[str, float]:
        return self.verdict["fit"][f"held_out_{unit}"]


def diagnose(bags: list[Path], twin: Path, out: Path) -> None:
    assert main(["diagnose", *map(str, bags), "--twin", str(twin), "--out", str(out)]) == 0
    assert (out / "report.html").stat().st_size > 0 and load_twin(out / "twin.yaml")


def read_diagnosed(folder: Path) -> Diagnosed:
    """Return what `diagnose` wrote into the folder `out` of a folder."""
    return Diagnosed(json.loads((folder / "out" / "verdict.json").read_text()))


def import_csv(csv: Path, out: Path, *columns: str) -> Path:
    assert main(["import", str(csv), "--out", str(out), *columns]) == 0
    return out


def cut_recording(bag: Path, out: Path, begin_s: float, end_s: float) -> Path:
    cut = [ROOT / "docs" / "cut_recording.py", bag, out, begin_s, end_s]
    subprocess.run([sys.executable, *map(str, cut)], check=True)
    return out


def write_twin(name: str, rig: Rig, folder: Path) -> Path:
    save_twin(Twin(name, rig), folder / "twin.yaml")
    return folder / "twin.yaml"


@pytest.fixture(scope="session")
def inteco(shared_data: Path, tmp_path_factory: pytest.TempPathFactory) -> Diagnosed:
    """Diagnose 40 s; `docs/real_rigs.md` has the whole minute, which takes four times as long."""
    folder = shared_data / "inteco_rig"

    def make(out: Path) -> None:
        part = cut_recording(folder / "open_loop_0_60s", out / "part", 0, 40)
        diagnose([part], folder / "twin.yaml", out / "out")

    return read_diagnosed(make_once(tmp_path_factory, "inteco", make))


@pytest.fixture(scope="session")
def chirps(shared_data: Path, tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Import five recordings of the Quanser cart, which all begin before the drive does."""
    files = sorted((shared_data / "quanser_cartpole" / "chirp").glob("*.csv"))

    def make(out: Path) -> None:
        for file in files:
            import_csv(file, out / file.stem, *QUANSER_COLUMNS)

    out = make_once(tmp_path_factory, "chirps", make)
    return [out / file.stem for file in files]


@pytest.fixture(scope="session")
def quanser(
    shared_data: Path, chirps: list[Path], tmp_path_factory: pytest.TempPathFactory
) -> Diagnosed:
    """Diagnose the first of the five."""
    twin = shared_data / "quanser_cartpole" / "twin.yaml"

    def make(out: Path) -> None:
        diagnose(chirps[:1], twin, out / "out")

    return read_diagnosed(make_once(tmp_path_factory, "quanser", make))


@pytest.fixture(scope="session")
def emps(shared_data: Path, tmp_path_factory: pytest.TempPathFactory) -> Diagnosed:
    def make(out: Path) -> None:
        columns = ("--time", "t", "--command", "vir", "--cart", "qm")
        bag = import_csv(shared_data / "emps" / "emps_estimation.csv", out / "bag", *columns)
        part = cut_recording(bag, out / "part", 0, 8)
        diagnose([part], write_twin("emps", EMPS_RIG, out), out / "out")

    return read_diagnosed(make_once(tmp_path_factory, "emps", make))


@pytest.fixture(scope="session")
def free_swing(shared_data: Path, tmp_path_factory: pytest.TempPathFactory) -> Diagnosed:
    def make(out: Path) -> None:
        csv = shared_data / "multiarm_free_swing" / "single_free_swing_id.csv"
        bag = import_csv(csv, out / "bag", "--time", "t", "--pole", "theta")
        diagnose([bag], write_twin("free swing", SWING_RIG, out), out / "out")

    return read_diagnosed(make_once(tmp_path_factory, "free_swing", make))


def test_the_thesis_s_rig_has_a_wrong_sign_and_dry_friction(inteco: Diagnosed) -> None:
    assert inteco.verdict["outcome"] in ("named", "ambiguous")
    assert "cart_sign_inverted" in inteco.names
    (friction,) = [e for e in inteco.verdict["missing_physics"] if e["effect"] in DRY]
    assert set(friction["cannot_be_told_from"]) <= DRY


def test_effects_that_the_thesis_s_rig_does_not_have_are_not_named(inteco: Diagnosed) -> None:
    absent = {"input_delay", "motor_lag", "input_dead_zone", "rail_tilt"}
    assert absent.isdisjoint(inteco.names)


def test_the_improved_twin_follows_the_thesis_s_rig(inteco: Diagnosed) -> None:
    assert inteco.get_held_out("cart_mm")["after"] <= 7.5  # of 40 s
    assert inteco.get_held_out("pole_rad")["after"] <= 0.034
    assert "drive_gain_over_shaft_turn" in [e["law"] for e in inteco.verdict["measured_laws"]]
    assert inteco.verdict["remainder"]["above_noise_floor"] > 2
    beginning = "cart_viscous_n_s_m had absorbed the missing"
    assert any(line.startswith(beginning) for line in inteco.verdict["masking"])


def test_a_half_without_a_name_still_shows_the_dry_friction(
    shared_data: Path, tmp_path: Path
) -> None:
    """What else is missing is larger than the friction, and takes nothing from its certainty."""
    folder = shared_data / "inteco_rig"
    half = cut_recording(folder / "open_loop_0_60s", tmp_path / "part", 30, 60)
    given = load_twin(folder / "twin.yaml")
    counted = replace(given, effects={"cart_sign_inverted": {}})
    recording = read_recording(half)
    prepared = prepare([recording], counted)
    base = fit_own_parameters(prepared.case, prepared.split)
    (reading,) = read_friction(Sight(prepared.case, base.theta))
    level = reading.estimates["level_n"]
    assert level.low < 0.47 < level.high  # as the first half and the whole have it


def test_faults_in_the_thesis_s_recording_are_reported(
    shared_data: Path, inteco: Diagnosed
) -> None:
    folder = shared_data / "inteco_rig"
    recording = read_recording(folder / "open_loop_0_60s")
    findings = prepare([recording], load_twin(folder / "twin.yaml")).findings
    assert {"wrap", "spike"} <= {finding.kind for finding in findings}
    assert "wrap" in {finding["kind"] for finding in inteco.verdict["data_quality"]}


def test_recordings_that_begin_before_the_drive_does_lose_their_start(
    shared_data: Path, chirps: list[Path]
) -> None:
    twin = load_twin(shared_data / "quanser_cartpole" / "twin.yaml")
    findings = prepare([read_recording(bag) for bag in chirps], twin).findings
    assert_stale_starts(findings, 5)


def test_the_verdict_tells_the_lost_starts(quanser: Diagnosed) -> None:
    findings = quanser.verdict["data_quality"]
    assert_stale_starts([QualityFinding(**finding) for finding in findings], 1)


def assert_stale_starts(findings: Iterable[QualityFinding], count: int) -> None:
    """Check that so many recordings have lost their start, and how much of it."""
    stale = [
        span for finding in findings if finding.kind == "stale" for span in finding.intervals_s
    ]
    assert len(stale) == count
    assert all(0.4 < end - begin < 0.7 for begin, end in stale)


def test_a_dead_start_is_taken_for_no_delay_and_no_dead_zone(quanser: Diagnosed) -> None:
    cart = quanser.get_held_out("cart_mm")
    assert cart["after"] < cart["before"] / 3
    assert "input_dead_zone" not in quanser.names
    delays = [e for e in quanser.verdict["missing_physics"] if e["effect"] == "input_delay"]
    assert all(e["parameters"]["delay_s"]["value"] < 0.05 for e in delays), "the start: 0.54 s"


def test_a_cart_alone(emps: Diagnosed) -> None:
    (friction,) = [
        effect
        for effect in emps.verdict["missing_physics"]
        if effect["effect"] == "cart_coulomb_friction"
    ]
    level = friction["parameters"]["level_n"]
    assert 18.0 < level["value"] < 27.0 and level["unit"] == "N"
    assert set(friction["cannot_be_told_from"]) <= DRY
    cart = emps.get_held_out("cart_mm")
    assert cart["after"] < 0.1 * cart["before"]


def test_a_pole_alone_without_command(free_swing: Diagnosed) -> None:
    pole = free_swing.get_held_out("pole_rad")
    assert pole["after"] < 0.5 * pole["before"]
    length = free_swing.verdict["rig_parameters"]["com_distance_m"]
    assert length["after"] == pytest.approx(SWING_LENGTH_M, rel=0.02)
    assert "held_out_cart_mm" not in free_swing.verdict["fit"]


def test_the_whole_names_what_its_first_half_names(free_swing: Diagnosed) -> None:
    """The disc is off its axis; the sizes of frictions change from its slow to its fast thirds."""
    assert "eccentric_encoder" in free_swing.names
    assert "pole_coulomb_friction" not in free_swing.names
