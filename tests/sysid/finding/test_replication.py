"""A lasting effect is found again in thirds; sizes that differ between blocks widen intervals."""

from dataclasses import replace

import numpy as np
import pytest
from support.hidden_physics import HIDDEN, INTECO, record_hidden

from pendulum_sysid.finding import replication
from pendulum_sysid.finding.replication import (
    BlockEstimates,
    Replication,
    compute_spread,
    estimate_part,
    join_intervals,
    replicate_effects,
    widen_intervals,
)
from pendulum_sysid.fitting.fit import HORIZONS, fit
from pendulum_sysid.fitting.linearised import linearise
from pendulum_sysid.fitting.noise_floor import measure_noise_floor
from pendulum_sysid.fitting.parameters import list_free_parameters
from pendulum_sysid.fitting.windows import shorten_windows
from pendulum_sysid.pipeline import is_at_noise
from pendulum_sysid.prepare import Prepared, prepare
from pendulum_sysid.records import Fit
from pendulum_twin.parameter_vector import SLOTS, make_theta

FRICTION = "cart_coulomb_friction"


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


def test_a_part_of_the_windows_does_not_hear_what_is_believed_beforehand() -> None:
    prepared, found = fit_friction((FRICTION,), 1)
    case = prepared.case
    free = list_free_parameters(case.twin, found.effects, case.scales)
    windows = shorten_windows(case.state, prepared.split.learn, found.pieces)
    system = linearise(case.problem(windows), found.theta, found.start_states, free, found.power)
    believed = replace(system, beliefs=np.full(len(free), 1e13), pulls=np.full(len(free), 3.0))
    part = np.arange(6 * found.pieces)
    alone, beside = (estimate_part(s, part, found, free) for s in (system, believed))
    np.testing.assert_array_equal(alone, beside)
    drawn = np.linalg.solve(believed.normal, believed.gradient)
    np.testing.assert_allclose(drawn, 3.0, rtol=0.1)  # the belief alone would say this


def test_one_of_three_is_not_lasting() -> None:
    assert not Replication(1, 3).is_lasting and not Replication(1, 2).is_lasting
    assert Replication(2, 3).is_lasting and Replication(1, 1).is_lasting


def test_the_spread_is_that_between_blocks_beyond_their_own_deviations() -> None:
    random = np.random.default_rng(0)
    spreads = [
        compute_spread(BlockEstimates(random.normal(1.0, np.hypot(0.3, 0.1), 6), np.full(6, 0.1)))
        for _ in range(400)
    ]
    assert abs(np.sqrt(np.mean(np.square(spreads))) - 0.3) < 0.03
    alike = BlockEstimates(np.full(6, 1.0), np.full(6, 0.1))
    assert compute_spread(alike) == 0.0


def test_blocks_that_fix_nothing_have_no_spread() -> None:
    deviations = np.array([0.1, 0.1, np.inf, np.inf, np.inf, np.inf])
    assert compute_spread(BlockEstimates(np.arange(6.0), deviations)) == 0.0


def test_intervals_widen_only_above_the_noise() -> None:
    prepared, found = fit_friction((FRICTION,), 2)
    assert widen_intervals(prepared.case, prepared.split, found) is found
    rough = replace(found, choose=5.0)
    wider = widen_intervals(prepared.case, prepared.split, rough)
    for name, estimate in found.estimates.items():
        assert wider.estimates[name].low <= estimate.low
        assert wider.estimates[name].high >= estimate.high


def test_a_fit_is_at_the_noise_on_windows_that_it_has_not_seen_too() -> None:
    prepared, found = fit_friction((FRICTION,), 2)
    case, split = prepared.case, prepared.split
    floor = measure_noise_floor(replace(case, twin=found.twin), found.theta, split.held_out)
    assert floor is not None and is_at_noise(case, split, found, floor)
    less = replace(floor, typical=0.3 * floor.typical)
    assert not is_at_noise(case, split, found, less)
    assert not is_at_noise(case, split, found, None)
    assert not is_at_noise(case, split, replace(found, choose=5.0), floor)


def test_above_the_noise_a_measured_law_narrows_no_interval() -> None:
    found = fit_friction((FRICTION,), 2)[1]
    level = found.estimates[f"{FRICTION}.level_n"]
    wide = replace(level, low=level.low - 0.1, high=level.high + 0.2)
    other = replace(found, estimates={f"{FRICTION}.level_n": wide})
    held = join_intervals(found, other).estimates
    assert held[f"{FRICTION}.level_n"] == wide
    del held[f"{FRICTION}.level_n"]
    assert all(found.estimates[name] == estimate for name, estimate in held.items())


@pytest.mark.parametrize("drag", ["friction_warming"])
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
