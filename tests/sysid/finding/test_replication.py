"""A lasting effect is found again in thirds; sizes that differ between blocks widen intervals."""

import functools
from dataclasses import replace

import numpy as np
import pytest
from support.hidden_physics import HIDDEN, INTECO, record_hidden
from support.made_recordings import made

from pendulum_sysid import decisions
from pendulum_sysid.finding import replication
from pendulum_sysid.finding.intervals import join_intervals, limit_sizes
from pendulum_sysid.finding.replication import (
    Replication,
    compute_spreads,
    divide_recordings,
    estimate_blocks,
    group_recordings,
    replicate_effects,
    widen_intervals,
)
from pendulum_sysid.fitting.fit import HORIZONS, fit
from pendulum_sysid.fitting.linearised import System
from pendulum_sysid.fitting.noise_floor import is_at_noise, measure_noise_floor
from pendulum_sysid.fitting.parameters import hold_constants, list_free_parameters
from pendulum_sysid.planning.aims import list_narrowings
from pendulum_sysid.prepare import Prepared, prepare
from pendulum_sysid.records import Estimate, Fit, Recording
from pendulum_twin.parameter_vector import SLOTS, make_theta

FRICTION = "cart_coulomb_friction"


@functools.cache
def fit_friction(hidden: tuple[str, ...], seed: int) -> tuple[Prepared, Fit]:
    recording = record_hidden({name: HIDDEN[name] for name in hidden}, seed, 30.0)[0]
    prepared = prepare([recording], INTECO)
    theta = make_theta(prepared.case.twin)
    theta[SLOTS[FRICTION]] = 0.3
    return prepared, fit(prepared.case, prepared.split, (FRICTION,), theta, HORIZONS[0])


def test_a_hidden_effect_is_found_again_in_every_third() -> None:
    prepared, found = fit_friction((FRICTION,), 1)
    replication = replicate_effects(prepared.case, prepared.split, found)[FRICTION]
    assert replication == Replication(3, 3) and replication.is_lasting
    assert str(replication) == "3 of 3"


def test_an_effect_that_is_not_there_is_not_lasting_or_not_asked() -> None:
    prepared, found = fit_friction((), 1)
    replication = replicate_effects(prepared.case, prepared.split, found)[FRICTION]
    assert replication.possible == 0 or not replication.is_lasting


def test_one_of_three_is_not_lasting() -> None:
    assert not Replication(1, 3).is_lasting and not Replication(1, 2).is_lasting
    assert Replication(2, 3).is_lasting and Replication(1, 1).is_lasting


def fit_effect(recordings: list[Recording], effect: str, *values: float) -> tuple[Prepared, Fit]:
    prepared = prepare(recordings, INTECO)
    theta = make_theta(prepared.case.twin)
    theta[SLOTS[effect]] = values
    return prepared, fit(prepared.case, prepared.split, (effect,), theta, HORIZONS[0])


def record_friction(level_n: float, seed: int, seconds: float) -> Recording:
    rig = replace(INTECO, effects={FRICTION: {"level_n": level_n}} if level_n else {})
    return made(rig, seconds, 0.2, seed)


@pytest.mark.parametrize(
    ("levels", "counts", "lasts"),
    [
        ((0.4, 0.4), Replication(2, 2), True),
        ((0.4, 0.0), Replication(1, 2), False),
        ((0.4, 0.4, 0.0), Replication(2, 3), True),
    ],
    ids=["in both", "in the longer alone", "in two of three"],
)
def test_recordings_are_asked_one_by_one(
    levels: tuple[float, ...], counts: Replication, lasts: bool
) -> None:
    """Thirds of the joined time would show what one long recording alone has."""
    recordings = [
        record_friction(level, seed, 24.0 if seed == 0 else 10.0)
        for seed, level in enumerate(levels)
    ]
    prepared, fitted = fit_effect(recordings, FRICTION, 0.3)
    shown = replicate_effects(prepared.case, prepared.split, fitted)[FRICTION]
    assert shown == counts and shown.is_lasting is lasts


def test_a_recording_that_cannot_show_an_effect_is_not_counted() -> None:
    """No command of the second recording reaches the limit."""
    rig = replace(INTECO, effects={"input_saturation": {"limit": 0.25}})
    recordings = [made(rig, 20.0, 0.4), made(rig, 20.0, 0.15, seed=1)]
    prepared, fitted = fit_effect(recordings, "input_saturation", 0.3)
    shown = replicate_effects(prepared.case, prepared.split, fitted)["input_saturation"]
    assert shown == Replication(1, 1) and shown.is_lasting


def test_many_recordings_are_asked_in_thirds_of_the_recordings_and_one_in_thirds_of_time() -> None:
    recordings = [made(INTECO, 6.0, 0.2, seed) for seed in range(5)]
    prepared, fitted = fit_effect(recordings, FRICTION, 0.1)
    case, learn = prepared.case, prepared.split.learn
    parts = divide_recordings(case, prepared.split, fitted)
    assert sorted(np.concatenate(parts)) == list(range(len(learn) * fitted.pieces))
    stretch = np.repeat(learn.begin // len(recordings[0].signals), fitted.pieces)
    assert [sorted(set(stretch[part])) for part in parts] == [[0, 1], [2, 3], [4]]
    prepared, fitted = fit_friction((FRICTION,), 1)
    sizes = [len(p) for p in divide_recordings(prepared.case, prepared.split, fitted)]
    assert len(sizes) == 3 and max(sizes) - min(sizes) <= fitted.pieces
    recording = prepared.case.recording
    recording = replace(recording, signals=recording.signals.break_at([1000]))
    broken = replace(prepared.case, recording=recording)
    assert [len(p) for p in divide_recordings(broken, prepared.split, fitted)] == sizes


def test_a_recording_without_learning_windows_keeps_its_number() -> None:
    """The recordings after it were numbered as if it were not there."""
    recordings = [made(INTECO, 6.0, 0.2, seed) for seed in range(4)]
    prepared = prepare(recordings, INTECO)
    case, split = prepared.case, prepared.split
    second = split.learn.begin // len(recordings[0].signals) == 1
    less = replace(split, train=split.learn.pick(~second), choose=split.learn.pick([]))
    groups = group_recordings(case, less)
    assert [group.numbers for group in groups] == [range(1, 2), range(3, 4), range(4, 5)]
    assert sorted(np.concatenate([group.windows for group in groups])) == [*range(len(less.learn))]


def make_system(columns: np.ndarray, errors: np.ndarray) -> System:
    """Return normal equations of a window for each error, (windows,), and its column."""
    scores = columns * errors[:, None]
    normals = columns[:, :, None] * columns[:, None, :]
    return System(normals, scores, *(np.empty(0) for _ in range(4)), [])


def compute_one_spread(columns: np.ndarray, errors: np.ndarray, choose: float = 1e3) -> float:
    """Return the spread of the last parameter, in its size, of windows in two pieces."""
    prepared, found = fit_friction((FRICTION,), 1)
    free = list_free_parameters(prepared.case.twin, found.effects, prepared.case.scales)
    free = free[: columns.shape[1]]
    rough = replace(found, pieces=2, choose=choose)
    return float(compute_spreads(make_system(columns, errors), rough, free)[-1] / free[-1].size)


def test_the_spread_is_how_far_blocks_draw_a_parameter() -> None:
    offsets = np.array([0.3, -0.1, 0.2, -0.4, 0.1, -0.1])
    alike, drawn = np.ones((60, 1)), np.repeat(offsets, 10)
    own_weight = np.sqrt(1.0 - 1.0 / 6.0)  # of a block, which its error has drawn the fit along by
    spread = compute_one_spread(alike, drawn)
    assert spread == pytest.approx(offsets.std(ddof=1) / own_weight, rel=1e-5)
    half_noise = compute_one_spread(alike, drawn, choose=np.sqrt(2.0))
    assert half_noise == pytest.approx(np.sqrt(0.5) * spread, rel=1e-5)
    assert compute_one_spread(alike[:8], drawn[:8]) == 0.0  # two blocks of two windows


def test_blocks_of_unlike_weight_have_a_spread_as_wide() -> None:
    """The estimate of a parameter that a block fixes by four fifths errs by the block's offset."""
    random = np.random.default_rng(0)
    weights = np.repeat(np.sqrt([20.0, 1.0, 1.0, 1.0, 1.0, 1.0]), 10)
    spreads = [
        compute_one_spread(weights[:, None], weights * np.repeat(random.normal(size=6), 10))
        for _ in range(40)
    ]
    assert np.sqrt(np.mean(np.square(spreads))) > 0.8


def test_a_drift_is_asked_over_the_whole_recording() -> None:
    prepared, found = fit_friction((FRICTION,), 1)
    free = list_free_parameters(prepared.case.twin, found.effects, prepared.case.scales)[:2]
    time = np.linspace(-0.5, 0.5, 60)
    columns = np.column_stack([np.ones(60), time])
    errors = np.random.default_rng(0).normal(size=60)
    rough = replace(found, pieces=1, choose=1e3)
    system = make_system(columns, errors)
    spread = float(compute_spreads(system, rough, free)[1])
    alone = estimate_blocks(system, rough, free, decisions.SPREAD_BLOCKS)[free[1].name]
    assert 0.0 < spread < 0.5 * alone.values.std(ddof=1)  # a minute fixes a rate, ten seconds less


def test_without_a_free_parameter_there_is_no_interval_to_widen_or_to_plan_for() -> None:
    """`--hold all` ended in a traceback where nothing was found."""
    twin = hold_constants(INTECO, ("all",))
    prepared = prepare([made(twin, 8.0)], twin)
    case, split = prepared.case, prepared.split
    far = replace(fit(case, split, (), make_theta(twin), HORIZONS[0]), choose=5.0)
    assert widen_intervals(case, split, far) is far
    assert list_narrowings(case, split, far) == []


def test_intervals_widen_by_the_spread_above_the_noise(monkeypatch: pytest.MonkeyPatch) -> None:
    prepared, fitted = fit_friction((FRICTION,), 2)
    case, split = prepared.case, prepared.split
    assert widen_intervals(case, split, fitted) is fitted
    rough = replace(fitted, choose=5.0)
    beside = widen_intervals(case, split, rough).estimates
    monkeypatch.setattr(replication, "DRAGS", ())
    spread = 0.4 * (fitted.estimates[f"{FRICTION}.level_n"].high - 0.3)
    monkeypatch.setattr(
        replication, "compute_spreads", lambda system, fit, free: np.full(len(free), spread)
    )
    alone = widen_intervals(case, split, rough).estimates
    level, wider = (estimates[f"{FRICTION}.level_n"] for estimates in (fitted.estimates, alone))
    half = np.hypot(level.high - level.value, decisions.INTERVAL_DEVIATIONS * spread)
    assert wider.high - wider.value == pytest.approx(half, rel=1e-6)
    for name, estimate in fitted.estimates.items():
        assert beside[name].low <= estimate.low and estimate.high <= beside[name].high


def test_a_fit_is_at_the_noise_on_windows_that_it_has_not_seen_too() -> None:
    prepared, found = fit_friction((FRICTION,), 2)
    case, split = prepared.case, prepared.split
    floor = measure_noise_floor(replace(case, twin=found.twin), found.theta, split.held_out)
    assert floor is not None and is_at_noise(case, split, found, floor)
    less = replace(floor, typical=0.3 * floor.typical)
    assert not is_at_noise(case, split, found, less)
    assert not is_at_noise(case, split, found, None)
    assert not is_at_noise(case, split, replace(found, choose=5.0), floor)


def test_joined_intervals_hold_those_of_both_fits() -> None:
    fitted = fit_friction((FRICTION,), 2)[1]
    name = f"{FRICTION}.level_n"
    level = fitted.estimates[name]
    wide = replace(level, low=level.low - 0.1, high=level.high + 0.2)
    other = replace(fitted, estimates={name: wide})
    joined = join_intervals(fitted, other, fitted.estimates).estimates
    assert joined[name] == wide
    assert all(joined[n] == e for n, e in fitted.estimates.items() if n != name)
    assert join_intervals(fitted, other, ["cart_viscous_n_s_m", "none"]) == fitted


@pytest.mark.parametrize(
    ("own", "told", "bounded"),
    [((0.38, 0.42), (0.0, 0.9), (0.2, 0.6)), ((0.1, 0.7), (0.0, 0.9), (0.1, 0.7)),
     ((0.38, 0.42), (0.3, 0.5), (0.3, 0.5))],
    ids=["by its steadiness", "by its own interval", "better than steady"],
)  # fmt: skip
def test_a_steady_size_is_known_to_half(
    own: tuple[float, float], told: tuple[float, float], bounded: tuple[float, float]
) -> None:
    prepared, fitted = fit_friction((), 5)
    theta, scales = fitted.theta.copy(), prepared.case.scales
    theta[SLOTS[FRICTION]] = 0.4
    name = "cart_coulomb_friction.level_n"

    def tell(low: float, high: float) -> Fit:
        return replace(fitted, theta=theta, estimates={name: Estimate(0.4, low, high)})

    size = limit_sizes(tell(*told), tell(*own), [FRICTION], scales).estimates[name]
    assert (size.low, size.high) == pytest.approx(bounded)
    assert limit_sizes(tell(*told), tell(*own), [], scales) == tell(*told)


def test_the_sizes_of_an_effect_are_steady_together() -> None:
    """Environments do not tell a sine of 0 beside a cosine of 0.04 rad."""
    prepared, fitted = fit_friction((), 5)
    theta = fitted.theta.copy()
    theta[SLOTS["eccentric_encoder"]] = 0.0, 0.04
    names = ("eccentric_encoder.sine_rad", "eccentric_encoder.cosine_rad")
    own = {
        name: Estimate(v, v - 0.001, v + 0.001) for name, v in zip(names, (0.0, 0.04), strict=True)
    }
    wide = {name: replace(e, low=-1.0, high=1.0) for name, e in own.items()}
    joined, narrow = (replace(fitted, theta=theta, estimates=e) for e in (wide, own))
    limited = limit_sizes(joined, narrow, ["eccentric_encoder"], prepared.case.scales).estimates
    assert [limited[n].low for n in names] == pytest.approx([-0.02, 0.02])
    assert [limited[n].high for n in names] == pytest.approx([0.02, 0.06])


@pytest.mark.parametrize("drag", ["cart_quadratic_drag"])
def test_a_viscous_constant_is_known_no_better_than_an_unnamed_drag_leaves_it(
    drag: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    recording, truth = record_hidden({drag: HIDDEN[drag]}, 3, 30.0)
    prepared = prepare([recording], INTECO)
    found = fit(prepared.case, prepared.split, (), make_theta(prepared.case.twin), HORIZONS[0])
    beside = widen_intervals(prepared.case, prepared.split, found)
    monkeypatch.setattr(replication, "DRAGS", ())
    alone = widen_intervals(prepared.case, prepared.split, found)
    missed, held = (f.estimates["cart_viscous_n_s_m"] for f in (alone, beside))
    true = truth.rig.cart_viscous_n_s_m
    assert true is not None and not missed.low <= true <= missed.high
    assert held.low <= true <= held.high
