"""A search that began wrong, with a sign or with a first step, is begun again; one that ends at the noise is not."""

from dataclasses import replace

import numpy as np
import pytest
from support.hidden_physics import HIDDEN, INTECO, hidden

from pendulum_sysid.finding.propose import propose
from pendulum_sysid.finding.search import (
    Search,
    begun_otherwise,
    parameters_alone,
    settled,
    simplest_of_each,
)
from pendulum_sysid.fitting.fit import HORIZONS, fit
from pendulum_sysid.fitting.split import split_windows
from pendulum_sysid.prepare import prepare_case
from pendulum_sysid.records import Fit
from pendulum_twin.parameter_vector import SLOTS, make_theta

PATCH = {"rail_friction_patch": {"level_n": 0.9, "centre_m": 0.05, "width_m": 0.07}}
BROAD = (1.5, 0.08, 0.35)
WRONG_SIGN = {"angle_sign_inverted": {}, "angle_scale": {"ratio": -0.045}}


def search_of(effects: dict, seed: int) -> Search:
    recording, _ = hidden(effects, seed, 20.0)
    case = prepare_case([recording], INTECO)
    return Search(case, split_windows(case.signals, case.state), lambda line: None)


def steps_from(search: Search, base: Fit, names: tuple[str, ...]) -> dict[str, Fit]:
    """Return the fits of the base with one effect each."""
    found = {one.effect: one for one in propose(search.case, search.split, base)}
    return {name: search.fitted((*base.effects, name), base, found[name].theta) for name in names}


def test_a_first_step_that_leaves_more_than_noise_is_exchanged_for_another() -> None:
    search = search_of({"cart_coulomb_friction": {"level_n": 0.5}, **PATCH}, 3)
    base = parameters_alone(search)
    theta = base.theta.copy()
    theta[SLOTS["rail_friction_patch"]] = BROAD
    broad = search.fitted(("rail_friction_patch",), base, theta)
    dry = steps_from(search, base, ("cart_coulomb_friction",))["cart_coulomb_friction"]
    found = begun_otherwise(search, base, [broad, dry], broad)
    assert set(found.effects) == {"cart_coulomb_friction", "rail_friction_patch"}
    assert broad.choose > 2.0 and found.choose < 1.2


def test_what_the_pole_said_by_itself_is_taken_back() -> None:
    """With a wrong scale of the cart's way the pole by itself seems to hang in a spring."""
    search = search_of({"position_scale": {"ratio": -0.3}}, 1)
    base = parameters_alone(search)
    spring = steps_from(search, base, ("pole_spring",))["pole_spring"]
    search.expected = ("pole_spring",)
    assert begun_otherwise(search, base, [], spring).effects == ("position_scale",)
    assert search.expected == ()


def test_a_search_that_ended_at_the_noise_is_left_alone() -> None:
    search = search_of({"rail_tilt": HIDDEN["rail_tilt"]}, 1)
    base = parameters_alone(search)
    good = steps_from(search, base, ("rail_tilt", "cart_coulomb_friction"))
    assert (
        begun_otherwise(search, base, list(good.values()), good["rail_tilt"]) is good["rail_tilt"]
    )


def test_another_end_that_leaves_more_than_noise_is_not_believed() -> None:
    recording, _ = hidden({"rail_tilt": HIDDEN["rail_tilt"]}, 1, 20.0)
    signals = recording.signals
    shaken = replace(signals, cart=signals.cart + 1e-3 * np.sin(40.0 * signals.times_s))
    case = prepare_case([replace(recording, signals=shaken)], INTECO)
    search = Search(case, split_windows(case.signals, case.state), lambda line: None)
    base = parameters_alone(search)
    good = steps_from(search, base, ("gain_drift", "rail_tilt"))
    assert good["rail_tilt"].choose < good["gain_drift"].choose
    assert (
        begun_otherwise(search, base, list(good.values()), good["gain_drift"])
        is good["gain_drift"]
    )


def test_of_effects_that_contain_one_another_the_simplest_is_a_beginning() -> None:
    base = parameters_alone(search_of({}, 1))
    names = ("cart_stribeck_friction", "cart_coulomb_friction", "rail_friction_patch")
    good = [replace(base, effects=(name,)) for name in names]
    assert [one.effects[-1] for one in simplest_of_each(good)] == [
        "cart_coulomb_friction",
        "rail_friction_patch",
    ]
    assert [one.effects[-1] for one in simplest_of_each(good, good[:1])] == ["rail_friction_patch"]


@pytest.mark.parametrize(
    ("effects", "turned"), [(WRONG_SIGN, True), ({"angle_scale": {"ratio": -0.045}}, False)]
)
def test_a_sign_in_doubt_is_settled_by_what_a_search_comes_to(effects: dict, turned: bool) -> None:
    search = search_of(effects, 1)
    theta = make_theta(search.case.twin)
    other = theta.copy()
    other[SLOTS["angle_sign_inverted"]] = 1.0
    plain, mirrored = (
        fit(search.case, search.split, names, start, HORIZONS[0])
        for names, start in (((), theta), (("angle_sign_inverted",), other))
    )
    assert settled(search, plain, [mirrored]) is (mirrored if turned else plain)
