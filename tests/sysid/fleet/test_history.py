"""A rig of sixty days with three concealed changes, quiet rigs, the twin of today, a page."""

import gzip
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from support.drawn_verdicts import make_named
from support.fleet_rows import SIZES, draw_history, make_result
from support.made_recordings import INTECO

from pendulum_sysid import decisions
from pendulum_sysid.cli import main
from pendulum_sysid.fleet.comparison import compare_rigs, get_recent
from pendulum_sysid.fleet.history import (
    WEEK_S,
    compute_errors,
    describe_history,
    read_histories,
)
from pendulum_sysid.fleet.rows import RIG, Result
from pendulum_sysid.fleet.store import Store
from pendulum_sysid.fleet.work import fill_row
from pendulum_twin.laws.law import Law
from pendulum_twin.model import load_twin, save_twin

DAYS = np.arange(60.0)
OFFSET = "angle_offset.angle_rad"
# friction doubles on day 20, the drive's force sinks from day 35 on, the pole is remounted on 50
COURSES = {
    "cart_viscous_n_s_m": np.where(DAYS < 20, 0.5, 1.0),
    "force_per_pwm_n": 12.86 - 0.06 * np.maximum(DAYS - 34, 0.0),
    "com_distance_m": np.where(DAYS < 50, 0.0196, 0.0206),
}


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Store:
    store = Store(str(tmp_path_factory.mktemp("store") / "store"))
    store.create()
    twin = tmp_path_factory.mktemp("twin") / "twin.yaml"
    save_twin(INTECO, twin)
    store.write_twin("sha256:0", twin.read_bytes())
    store.write(draw_history("bench_07", DAYS, 1, COURSES))
    for number in range(5):
        store.write(draw_history(f"quiet_{number}", DAYS[:20], 10 + number))
    return store


def tell(store: Store, capsys, rig: str) -> dict:
    assert main(["fleet", "history", store.address, "--rig", rig, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def test_each_change_is_found_within_a_day_and_named(store: Store, capsys) -> None:
    changes = {c["size"]: c for c in tell(store, capsys, "bench_07")["changes"]}
    assert set(changes) == set(COURSES)
    days = {name: int(c["first_recording_after"][-6:-3]) for name, c in changes.items()}
    assert days["cart_viscous_n_s_m"] == 20 and days["com_distance_m"] == 50
    assert abs(days["force_per_pwm_n"] - 35) <= 1
    kinds = {name: c["kind"] for name, c in changes.items()}
    assert kinds == {
        "cart_viscous_n_s_m": "step", "force_per_pwm_n": "drift begins", "com_distance_m": "step",
    }  # fmt: skip
    friction = changes["cart_viscous_n_s_m"]
    assert friction["after"] / friction["before"] == pytest.approx(2.0, rel=0.05)
    assert main(["fleet", "history", store.address, "--rig", "bench_07"]) == 0
    assert "between 2026-01-24" in capsys.readouterr().out


def test_a_step_away_from_nothing_is_told_without_a_share(tmp_path: Path, capsys) -> None:
    """An offset near 0 that becomes 0.02 rad grows by no number of per cent."""
    store = Store(str(tmp_path / "store"))
    store.create()
    sizes = [(1e-6 if day < 10 else 0.02, 1e-3, "rad") for day in range(20)]
    store.write([make_result("bench", day, {OFFSET: size}) for day, size in enumerate(sizes)])
    (sentence, *_) = tell(store, capsys, "bench")["sentences"]
    assert "angle_offset.angle_rad went from 1e-06 to 0.02 rad, between" in sentence


def test_quiet_rigs_have_no_history(store: Store, capsys) -> None:
    for number in range(5):
        told = tell(store, capsys, f"quiet_{number}")
        assert told["changes"] == [] == told["drifts"]
        assert "no change shows in 20 recordings" in told["sentences"][0]


def test_next_week_follows_the_drift(store: Store, capsys) -> None:
    sizes = tell(store, capsys, "bench_07")["sizes"]
    expected = sizes["force_per_pwm_n"]["next_week"]
    assert expected["low"] < 12.86 - 0.06 * 32 < expected["high"] < 11.3


def test_next_week_of_a_drift_is_as_wide_as_any_interval(store: Store) -> None:
    (history,) = read_histories(store, "bench_07")
    (force,) = (size for size in history.sizes if size.name == "force_per_pwm_n")
    piece, last = force.course.pieces[-1], force.rows["time"].iloc[-1]
    away_s = last.timestamp() + WEEK_S - piece.middle_s
    error = np.hypot(piece.error, piece.slope_error * away_s)
    half = decisions.INTERVAL_DEVIATIONS * np.hypot(error, force.course.spread)
    value, low, high = force.next_week
    assert piece.slope and (value - low, high - value) == pytest.approx((half, half))


def test_rigs_are_compared_by_where_a_drift_has_come(store: Store) -> None:
    (history,) = read_histories(store, "bench_07")
    (force,) = (size for size in history.sizes if size.name == "force_per_pwm_n")
    values, errors = get_recent(force)
    assert len(values) > 20 and values == pytest.approx(12.86 - 0.06 * 25, abs=6 * errors.max())


def test_an_interval_that_a_bound_cuts_has_the_error_of_its_other_side() -> None:
    rows = pd.DataFrame({"value": [1.0, 1.0], "low": [1.0, 0.8], "high": [1.4, 1.0]})
    assert compute_errors(rows) == pytest.approx(
        np.array([0.4, 0.2]) / decisions.INTERVAL_DEVIATIONS
    )


def test_the_twin_of_today(store: Store, tmp_path: Path, capsys) -> None:
    out = tmp_path / "today.yaml"
    words = ["fleet", "twin", store.address, "--rig", "bench_07", "--out", str(out)]
    assert main(words) == 0
    rig = load_twin(out).rig
    assert rig.cart_viscous_n_s_m == pytest.approx(1.0, abs=0.02)
    assert rig.force_per_pwm_n == pytest.approx(12.86 - 0.06 * 25, abs=0.1)
    assert rig.cart_mass_kg == INTECO.rig.cart_mass_kg


def test_the_twin_of_today_keeps_laws_and_spreads_of_its_twin(tmp_path: Path, capsys) -> None:
    """A twin without its measured laws is another rig, and one without spreads a guess."""
    law = Law((-0.4, 0.0, 0.4), (1.0, 0.0, -1.0))
    nominal = replace(
        INTECO,
        measured_laws={"cart_force_by_position": law},
        spreads={"cart_mass_kg": 0.02, "gravity_m_s2": 0.0},
    )
    save_twin(nominal, tmp_path / "twin.yaml")
    store = Store(str(tmp_path / "store"))
    store.create()
    store.write_twin("sha256:0", (tmp_path / "twin.yaml").read_bytes())
    store.write(draw_history("bench", DAYS[:8], 1))
    out = tmp_path / "today.yaml"
    assert main(["fleet", "twin", store.address, "--rig", "bench", "--out", str(out)]) == 0
    today = load_twin(out)
    assert today.name == "bench" and today.rig != nominal.rig
    assert today.measured_laws == nominal.measured_laws
    assert today.spreads == nominal.spreads


def test_a_rig_that_is_unlike_the_others_is_named(store: Store, capsys) -> None:
    comparison = compare_rigs(read_histories(store))
    assert {u.rig for u in comparison.unlike} == {"bench_07"}
    assert "cart_viscous_n_s_m" in {u.size for u in comparison.unlike}
    assert main(["fleet", "compare", store.address]) == 0
    assert "bench_07 is unlike the others in cart_viscous_n_s_m" in capsys.readouterr().out


def test_an_effect_that_most_rigs_lack_belongs_into_the_nominal_twin(tmp_path: Path) -> None:
    store = Store(str(tmp_path / "store"))
    store.create()
    friction = {"cart_coulomb_friction.level_n": (0.46, 0.02, "N")}
    constants = {"force_per_pwm_n": SIZES["force_per_pwm_n"]}
    for rig in range(5):
        named = friction if rig < 4 else {}
        store.write(
            [
                make_result(f"r{rig}", d, constants | named, method="diagnose", outcome="named")
                for d in range(9)
            ]
        )
    (shared,) = compare_rigs(read_histories(store)).shared
    assert (shared.effect, shared.rigs, shared.of) == ("cart_coulomb_friction", 4, 5)
    _, low, high, unit = shared.parameters["level_n"]
    assert low < 0.46 < high and unit == "N"


def test_an_effect_that_appears_is_a_change(tmp_path: Path, capsys) -> None:
    store = Store(str(tmp_path / "store"))
    store.create()
    friction = {"cart_coulomb_friction.level_n": (0.46, 0.02, "N")}
    constants = {"force_per_pwm_n": SIZES["force_per_pwm_n"]}
    for day in range(30):
        sizes = constants | (friction if day >= 18 else {})
        store.write([make_result("r", day, sizes, method="diagnose", outcome="named")])
    (change,) = tell(store, capsys, "r")["changes"]
    assert change["size"] == "cart_coulomb_friction.named"
    assert change["first_recording_after"].endswith("day_018.00")


def test_a_recording_that_is_unlike_its_rig_does_not_count(tmp_path: Path) -> None:
    """A file of another rig has other constants, and lacks what is named here."""
    store = Store(str(tmp_path / "store"))
    store.create()
    value, error, unit = SIZES["force_per_pwm_n"]
    for day in range(20):
        foreign = day == 12
        sizes = {"force_per_pwm_n": (3.0 * value if foreign else value, error, unit)}
        outcome = "unlike_rig" if foreign else "named"
        store.write([make_result("r", day, sizes, method="diagnose", outcome=outcome)])
    (history,) = read_histories(store)
    assert (len(history.recordings), len(history.unanswered)) == (19, 1)
    assert {len(size.rows) for size in history.sizes} == {19} and not history.changes
    assert not history.ends_strange
    assert "1 recording does not look like r" in describe_history(history)[-1]


def test_a_rig_whose_last_recordings_are_unlike_it_needs_a_look(tmp_path: Path, capsys) -> None:
    store = Store(str(tmp_path / "store"))
    store.create()
    for day in range(30):
        outcome = "named" if day < 20 else "unlike_rig"
        store.write([make_result("r", day, SIZES, method="diagnose", outcome=outcome)])
    out = tmp_path / "site"
    assert main(["fleet", "page", store.address, "--out", str(out)]) == 0
    index, page = ((out / name).read_text() for name in ("index.html", "rig_r.html"))
    assert "1 of 1 rigs need a look" in index and "unlike itself" in index
    assert "10 recordings do not look like r" in page
    assert "no change shows in 20 recordings" in page


def test_the_row_of_a_recording_says_that_it_is_unlike_its_rig() -> None:
    row = make_result("r", 0, {}).recording
    assert fill_row(row, replace(make_named(), unlike_rig=True)).outcome == "unlike_rig"
    assert fill_row(row, make_named()).outcome == "named"


def test_the_site_tells_what_the_store_holds(tmp_path: Path, capsys) -> None:
    store = Store(str(tmp_path / "store"))
    store.create()
    friction = "cart_viscous_n_s_m"
    for rig, course in (("a_quiet", 0.5), ("b_changed", np.where(DAYS[:20] < 9, 0.5, 1.0))):
        rows = draw_history(rig, DAYS[:20], 3, {friction: course * np.ones(20)})
        for row in rows:
            recording = replace(row.recording, method="diagnose")
            store.write([Result(recording, row.sizes[:1])])
    digest = "sha256:b_changed000000.00000"
    report = f"{store.name_verdict_folder('b_changed', digest)}/report.html.gz"
    store.place.write(report, gzip.compress(b"the report"))
    out = tmp_path / "site"
    assert main(["fleet", "page", store.address, "--out", str(out)]) == 0
    index, page = ((out / n).read_text() for n in ("index.html", "rig_b_changed.html"))
    assert index.index("b_changed") < index.index("a_quiet")  # what needs a look comes first
    assert "1 of 2 rigs need a look" in index
    assert f"{friction} went from 0.5" in page and page.count("<svg") == 1
    assert "http://" not in page.replace("http://www.w3.org", "")
    (link,) = set(re.findall(r'href="(reports/[^"]+)"', page))
    assert (out / link).read_text() == "the report"


def test_rows_of_another_work_count_once(store: Store) -> None:
    """The same recordings examined again by a later version: the later rows count."""
    rows = draw_history("bench_07", DAYS, 1, COURSES)
    again = [_copy_later(result) for result in rows[:3]]
    store.write(again)
    recordings = store.read_recordings()
    own = recordings[recordings["rig"] == "bench_07"]
    assert len(own) == 60 and (own["version"] == "2").sum() == 3
    sizes = store.read_sizes()
    assert len(sizes[(sizes["rig"] == "bench_07") & (sizes["owner"] == RIG)]) == 60 * len(SIZES)


def _copy_later(result: Result) -> Result:
    later = replace(
        result.recording, version="2", written_at=result.recording.written_at.replace(year=2027)
    )
    return Result(later, result.sizes)


def test_a_misspelt_rig_is_refused_with_the_rig_that_was_meant(store: Store, capsys) -> None:
    assert main(["fleet", "history", store.address, "--rig", "bench_7"]) == 1
    assert "found --rig bench_7: did you mean bench_07?" in capsys.readouterr().err


def test_no_interval_goes_beyond_what_a_size_can_be(tmp_path: Path) -> None:
    """Three recordings that fix a friction badly: Student's t for two degrees goes far below 0."""
    store = Store(str(tmp_path / "store"))
    store.create()
    friction = "cart_coulomb_friction.level_n"
    for number, rig in enumerate("abc"):
        for day, value in enumerate((1e-5, 4e-4, 9e-4)):
            sizes = {
                "pole_viscous_n_m_s": (value + 1e-6 * number, 3e-4, "N m s/rad"),
                "pole_inertia_kg_m2": (4.0 * value, 1e-3, "kg m^2"),
                friction: (value, 5e-4, "N"),
            }
            store.write([make_result(rig, day, sizes)])
    histories = read_histories(store)
    for size in [size for history in histories for size in history.sizes]:
        today = size.today
        ends = (today.low, today.expected_low, size.next_week[1])
        assert min(ends) >= 0.0 and today.low < today.value < today.high, size.name
    for family in compare_rigs(histories).families.values():
        assert family.low >= 0.0 and min(rig.expected_low for rig in family.rigs) >= 0.0
