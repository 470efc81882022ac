"""Proposals: what is hidden stands near the top before anything has been refitted."""

import numpy as np
import pytest
from support.hidden_physics import HIDDEN, INTECO, hidden
from support.made_recordings import without_joint

from pendulum_sysid.finding.propose import Proposal, propose
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.fit import HORIZONS, fit
from pendulum_sysid.fitting.split import split_windows
from pendulum_sysid.prepare import prepare_case
from pendulum_sysid.records import Fit, Recording, Split
from pendulum_twin.effects import BY_NAME
from pendulum_twin.effects.effect import Form, Place
from pendulum_twin.parameter_vector import make_theta

WITH_SIZES = [
    name for name, sizes in HIDDEN.items() if sizes and BY_NAME[name].form is not Form.REPORT
]


def fitted_alone(recording: Recording) -> tuple[Case, Split, Fit]:
    case = prepare_case([recording], INTECO)
    parts = split_windows(case.signals, case.state)
    return case, parts, fit(case, parts, (), make_theta(case.twin), HORIZONS[0])


def proposed(effects: dict, seed: int) -> list[Proposal]:
    return propose(*fitted_alone(hidden(effects, seed, 20.0)[0]))


def test_what_is_hidden_is_ranked_first_or_second() -> None:
    ranks = {}
    for name in WITH_SIZES:
        order = [one.effect for one in proposed({name: HIDDEN[name]}, seed=1)]
        ranks[name] = order.index(name) + 1
    near_the_top = [name for name, rank in ranks.items() if rank <= 2]
    assert len(near_the_top) >= 0.8 * len(ranks), ranks
    assert max(ranks.values()) <= 5, ranks  # as many as are then fitted in full


def test_where_nothing_is_missing_little_is_promised() -> None:
    nothing = proposed({}, seed=1)[0].gain
    assert (
        nothing < 10 < 100 < proposed({"cart_coulomb_friction": {"level_n": 0.5}}, seed=1)[0].gain
    )


@pytest.mark.parametrize("name", ["cart_coulomb_friction", "input_delay", "angle_offset"])
def test_a_proposal_promises_a_start_near_the_truth(name: str) -> None:
    best = next(one for one in proposed({name: HIDDEN[name]}, seed=2) if one.effect == name)
    case, parts, _ = fitted_alone(hidden({name: HIDDEN[name]}, 2, 20.0)[0])
    after = fit(case, parts, best.effects, best.theta[0], HORIZONS[0])
    ((parameter, true),) = HIDDEN[name].items()
    assert after.estimates[f"{name}.{parameter}"].value == pytest.approx(true, rel=0.1)


def test_every_candidate_once_the_most_promising_first() -> None:
    found = proposed({"rail_tilt": HIDDEN["rail_tilt"]}, seed=1)
    names, gains = [one.effect for one in found], [one.gain for one in found]
    assert len(names) == len(set(names)) and gains == sorted(gains, reverse=True)
    assert all(BY_NAME[name].searched and BY_NAME[name].parameters for name in names)
    assert all(one.theta.shape[0] >= 1 and np.all(np.isfinite(one.theta)) for one in found)


def test_what_is_held_is_not_proposed_again_and_ratios_only_beside_dry_friction() -> None:
    effects = {"cart_coulomb_friction": {"level_n": 0.5}}
    case, parts, alone = fitted_alone(hidden(effects, 1, 20.0)[0])
    before = propose(case, parts, alone)
    assert "cart_friction_asymmetry" not in [one.effect for one in before]
    start = next(one for one in before if one.effect == "cart_coulomb_friction")
    held = fit(case, parts, start.effects, start.theta[0], HORIZONS[0])
    after = {one.effect: one for one in propose(case, parts, held)}
    assert "cart_coulomb_friction" not in after and "cart_friction_asymmetry" in after
    assert after["cart_stribeck_friction"].effects == (
        "cart_stribeck_friction",
    )  # in place of the simpler one
    assert max(one.gain for one in after.values()) < 0.1 * start.gain


@pytest.mark.parametrize(
    ("gone", "places"),
    [("pole", {Place.COMMAND, Place.DRIVE, Place.CART}), ("cart", {Place.POLE, Place.SENSOR})],
)
def test_only_what_the_rig_can_have_is_proposed(gone: str, places: set[Place]) -> None:
    case, parts, alone = fitted_alone(without_joint(hidden({}, 1, 20.0)[0], gone))
    found = propose(case, parts, alone)
    assert {BY_NAME[one.effect].place for one in found} == places
