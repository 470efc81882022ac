"""Effects that the given twin has: their sizes have a history, and nobody misses them."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from support.drawn_verdicts import make_named
from support.fleet_rows import make_result

from pendulum_sysid.fleet.comparison import compare_rigs, list_effects
from pendulum_sysid.fleet.history import PRESENCE, read_histories
from pendulum_sysid.fleet.rows import RIG, Result, SizeRow
from pendulum_sysid.fleet.store import Store
from pendulum_sysid.fleet.work import list_fitted_sizes, list_sizes
from pendulum_sysid.records import Estimate
from pendulum_sysid.verdict.record import RigParameter, Verdict

FRICTION, SIZE = "cart_coulomb_friction", "cart_coulomb_friction.level_n"
LEVEL = RigParameter(0.4, 0.41, 0.46, 0.42, 0.5, "N", identifiable=True, at_bound=False)
NAMED = replace(make_named(), missing_physics=make_named().missing_physics[:1])
GIVEN = replace(make_named(), missing_physics=(), effect_parameters={SIZE: LEVEL})


@pytest.fixture
def store(tmp_path: Path) -> Store:
    store = Store(str(tmp_path / "store"))
    store.create()
    return store


def write(store: Store, verdict: Verdict, rig: str = "r", days: range = range(9)) -> None:
    for day in days:
        recording = make_result(rig, day, {}, method="diagnose", outcome="named").recording
        store.write([Result(recording, list_sizes(recording, verdict))])


def pick(rows: tuple[SizeRow, ...], owner: str) -> list[tuple[object, ...]]:
    return [
        (r.parameter, r.unit, r.value, r.low, r.high, r.identifiable)
        for r in rows
        if r.owner == owner
    ]


@pytest.mark.parametrize(
    ("changes", "is_fixed"),
    [({}, True), ({"identifiable": False}, False), ({"at_bound": True}, False)],
)
def test_a_diagnosis_stores_sizes_of_given_effects_as_a_fit_does(
    changes: dict[str, bool], is_fixed: bool
) -> None:
    level = replace(LEVEL, **changes)
    row = make_result("r", 0, {}).recording
    diagnosed = list_sizes(row, replace(GIVEN, effect_parameters={SIZE: level}))
    estimate = Estimate(level.after, level.low, level.high, level.identifiable, level.at_bound)
    fitted = list_fitted_sizes(row, SimpleNamespace(estimates={SIZE: estimate}), {SIZE: "N"})
    expected = [("level_n", "N", 0.46, 0.42, 0.5, is_fixed)]
    assert pick(diagnosed, FRICTION) == pick(fitted, FRICTION) == expected
    assert {r.owner for r in diagnosed} == {RIG, FRICTION}


def test_a_given_effect_has_a_history_and_is_not_missing(store: Store) -> None:
    for rig in ("a", "b", "c", "d"):
        write(store, GIVEN, rig)
    histories = read_histories(store)
    for history in histories:
        (friction,) = (size for size in history.sizes if size.owner == FRICTION)
        assert (friction.name, friction.today.value) == (SIZE, pytest.approx(0.46))
        assert list_effects(history) == []
    comparison = compare_rigs(histories)
    assert SIZE in comparison.families and comparison.shared == ()


def test_an_effect_that_the_twin_got_meanwhile_is_neither_missing_nor_gone(store: Store) -> None:
    """The rig lacked nothing less often: its later recordings were not asked for the effect."""
    write(store, NAMED, days=range(12))
    (history,) = read_histories(store)
    assert list_effects(history) == [FRICTION]
    write(store, GIVEN, days=range(12, 24))
    (history,) = read_histories(store)
    assert list_effects(history) == [] == history.changes
    rows = {size.parameter: len(size.rows) for size in history.sizes if size.owner == FRICTION}
    assert rows == {"level_n": 24}


def test_an_effect_is_named_by_the_recordings_whose_twin_lacks_it(store: Store) -> None:
    """Back to a twin without the effect: those that had it meanwhile count neither way."""
    write(store, NAMED, days=range(6))
    write(store, GIVEN, days=range(6, 12))
    write(store, NAMED, days=range(12, 18))
    (history,) = read_histories(store)
    (presence,) = (size for size in history.sizes if size.parameter == PRESENCE)
    assert len(presence.rows) == 12 and list_effects(history) == [FRICTION]
