"""Rigs that were diagnosed and fitted, that share recordings, or have effects of their own."""

import gzip
import re
from dataclasses import replace
from pathlib import Path

import pytest
from support.drawn_verdicts import make_named
from support.fleet_rows import SIZES, make_result
from support.made_recordings import INTECO

from pendulum_sysid.cli import main
from pendulum_sysid.fleet import work as work_module
from pendulum_sysid.fleet.comparison import compare_rigs, describe_comparison, list_effects
from pendulum_sysid.fleet.history import read_histories
from pendulum_sysid.fleet.recordings import Source
from pendulum_sysid.fleet.store import Store
from pendulum_sysid.fleet.work import Work
from pendulum_twin.model import save_twin

CONSTANTS = {"force_per_pwm_n": SIZES["force_per_pwm_n"]}
FRICTION = {"cart_coulomb_friction.level_n": (0.46, 0.02, "N")}
DIAGNOSED = {"method": "diagnose", "outcome": "named"}


@pytest.fixture
def store(tmp_path: Path) -> Store:
    store = Store(str(tmp_path / "store"))
    store.create()
    save_twin(INTECO, tmp_path / "twin.yaml")
    store.write_twin("sha256:0", (tmp_path / "twin.yaml").read_bytes())
    return store


def test_a_fit_beside_diagnoses_forgets_no_effect(store: Store) -> None:
    store.write([make_result("r", day, CONSTANTS | FRICTION, **DIAGNOSED) for day in range(19)])
    store.write([make_result("r", 19, CONSTANTS)])
    (history,) = read_histories(store)
    assert list_effects(history) == ["cart_coulomb_friction"]


def test_rigs_without_a_diagnosis_do_not_count_as_lacking_nothing(store: Store) -> None:
    for rig in range(5):
        sizes = CONSTANTS | (FRICTION if rig < 2 else {})
        work = DIAGNOSED if rig < 2 else {}
        outcome = {"outcome": "unusable"} if rig == 4 else {}
        store.write([make_result(f"r{rig}", d, sizes, **(work | outcome)) for d in range(9)])
    (shared,) = compare_rigs(read_histories(store)).shared
    assert (shared.effect, shared.rigs, shared.of) == ("cart_coulomb_friction", 2, 2)


def test_a_shared_effect_has_the_size_of_the_rigs_that_lack_it(store: Store) -> None:
    """A rig that showed the effect once, by chance, does not widen its size."""
    wild = {"cart_coulomb_friction.level_n": (5.0, 0.02, "N")}
    for rig in range(4):
        for day in range(9):
            own = FRICTION if rig < 3 else wild if day == 0 else {}
            store.write([make_result(f"r{rig}", day, CONSTANTS | own, **DIAGNOSED)])
    (shared,) = compare_rigs(read_histories(store)).shared
    _, low, high, _ = shared.parameters["level_n"]
    assert shared.rigs == 3 and 0.4 < low < 0.46 < high < 0.5


def test_fits_are_not_asked_for_missing_effects(store: Store) -> None:
    for rig in range(5):
        store.write([make_result(f"r{rig}", day, CONSTANTS) for day in range(9)])
    (sentence,) = describe_comparison(compare_rigs(read_histories(store)))
    assert sentence == "No rig is unlike the others. No effect was asked for: a fit names none."


def test_an_effect_of_ones_own_that_is_not_loaded_is_told(
    store: Store, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mine = {"rail_wave.size_n": (0.46, 0.02, "N")}
    store.write([make_result("r", day, CONSTANTS | mine, **DIAGNOSED) for day in range(9)])
    out = tmp_path / "today.yaml"
    assert main(["fleet", "twin", store.address, "--rig", "r", "--out", str(out)]) == 1
    error = capsys.readouterr().err
    assert "found rail_wave: give --effects FOLDER as the run did" in error
    assert not out.exists()


def test_each_rig_has_its_own_report_of_a_recording_that_two_rigs_hold(
    store: Store, tmp_path: Path
) -> None:
    for rig in ("a", "b", "fitted"):
        work = DIAGNOSED if rig != "fitted" else {}
        store.write([make_result(rig, 0, CONSTANTS, digest="sha256:same", **work)])
        report = f"{store.name_verdict_folder(rig, 'sha256:same')}/report.html.gz"
        store.place.write(report, gzip.compress(f"report of {rig}".encode()))
    out = tmp_path / "site"
    assert main(["fleet", "page", store.address, "--out", str(out)]) == 0
    for rig in ("a", "b"):
        (link,) = re.findall(r'href="(reports/[^"]+)"', (out / f"rig_{rig}.html").read_text())
        assert (out / link).read_text() == f"report of {rig}"
    assert 'href="reports/' not in (out / "rig_fitted.html").read_text()


def test_a_verdict_without_a_twin_leaves_no_earlier_twin_beside_it(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(work_module, "render_page", lambda verdict: "a report")
    source = Source("/bench", "r/day", ("r/day/0.mcap",))
    work = Work(source, "sha256:1", 0, "r", b"", "sha256:0", None, "diagnose", store.address)
    folder = store.name_verdict_folder("r", "sha256:1")
    for twin in (None, INTECO, None):
        work_module._keep_verdict(replace(make_named(), twin=twin), work)
        assert (store.place.read(f"{folder}/twin.yaml") is None) == (twin is None)
