"""A search that began wrong, with a sign or with a first step, begins again."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from support.hidden_physics import HIDDEN, INTECO, record_hidden

from pendulum_sysid import decisions
from pendulum_sysid.finding.growth import (
    find_steps,
    grow_set,
    list_contained,
    list_simplest,
    order_proposals,
)
from pendulum_sysid.finding.journal import Search
from pendulum_sysid.finding.pole_alone import PoleAnswer
from pendulum_sysid.finding.propose import Proposal, propose
from pendulum_sysid.finding.search import Explanation, begin_otherwise
from pendulum_sysid.finding.signs import fit_parameters_alone, settle_sign
from pendulum_sysid.fitting.fit import HORIZONS, fit
from pendulum_sysid.fitting.split import split_windows
from pendulum_sysid.prepare import prepare_case
from pendulum_sysid.records import Fit, Recording
from pendulum_twin.effects import BY_NAME
from pendulum_twin.parameter_vector import SLOTS, make_theta

PATCH = {"rail_friction_patch": {"level_n": 0.9, "centre_m": 0.05, "width_m": 0.07}}
BROAD = (1.5, 0.08, 0.35)
WRONG_SCALE = {"angle_scale": {"ratio": -0.045}}
WRONG_SIGN = {"angle_sign_inverted": {}, **WRONG_SCALE}
TILT = {"rail_tilt": HIDDEN["rail_tilt"]}


def make_search(recording: Recording) -> Search:
    case = prepare_case([recording], INTECO)
    return Search(case, split_windows(case.signals, case.state))


def search_hidden(effects: dict, seed: int) -> Search:
    return make_search(record_hidden(effects, seed, 20.0)[0])


@cache
def search_tilt() -> tuple[Search, Fit]:
    """Return a search of a tilted rail, with the fit of parameters alone."""
    search = search_hidden(TILT, 1)
    return search, fit_parameters_alone(search)


def take_steps(search: Search, base: Fit, names: tuple[str, ...]) -> dict[str, Fit]:
    """Return the fits of the base with one effect each."""
    proposals = {
        proposal.effect: proposal for proposal in propose(search.case, search.split, base)
    }
    return {
        name: search.fit_effects((*base.effects, name), base, proposals[name].theta)
        for name in names
    }


def test_a_first_step_that_leaves_more_than_noise_is_exchanged_for_another() -> None:
    search = search_hidden({"cart_coulomb_friction": {"level_n": 0.5}, **PATCH}, 3)
    base = fit_parameters_alone(search)
    theta = base.theta.copy()
    theta[SLOTS["rail_friction_patch"]] = BROAD
    broad = search.fit_effects(("rail_friction_patch",), base, theta)
    dry = take_steps(search, base, ("cart_coulomb_friction",))["cart_coulomb_friction"]
    end = begin_otherwise(search, base, [broad, dry], Explanation(broad, None))
    assert set(end.fit.effects) == {"cart_coulomb_friction", "rail_friction_patch"}
    assert broad.choose > 2.0 and end.fit.choose < 1.2


def test_a_search_that_comes_back_to_another_grows_no_further() -> None:
    search, base = search_tilt()
    tilt = take_steps(search, base, ("rail_tilt",))["rail_tilt"]
    noted = len(search.journal.trials)
    assert grow_set(search, tilt, known=tilt) is tilt
    assert len(search.journal.trials) == noted
    grown = grow_set(search, base, known=tilt)
    assert grown.effects == ("rail_tilt",)


def test_a_proposal_that_promises_next_to_nothing_is_not_fitted() -> None:
    search, base = search_tilt()
    tilt = take_steps(search, base, ("rail_tilt",))["rail_tilt"]
    for fit_so_far, is_complete in ((base, False), (tilt, True)):
        noted = len(search.journal.trials)
        find_steps(search, fit_so_far)
        tried = {trial.effects[-1] for trial in search.journal.trials[noted:]}
        proposals = propose(search.case, search.split, fit_so_far)[: decisions.CANDIDATES_REFITTED]
        worth = {p.effect for p in proposals if p.gain >= decisions.PROPOSAL_LEAST_NATS}
        waiting = worth - tried
        assert tried <= worth and all(set(BY_NAME[name].simpler) & tried for name in waiting)
        assert len(worth) < len(proposals) if is_complete else worth


def make_proposals(**gains: float) -> list[Proposal]:
    return [Proposal(name, (name,), np.zeros((1, 1)), gain) for name, gain in gains.items()]


def test_an_effect_waits_for_the_simpler_effect_that_promises_as_much() -> None:
    proposals = make_proposals(
        cart_presliding_friction=100.0, cart_coulomb_friction=99.0, rail_tilt=3.0
    )
    presliding = proposals[0]
    assert list_contained(presliding, proposals) == ["cart_coulomb_friction"]
    ordered = [proposal.effect for proposal in order_proposals(proposals)]
    assert ordered == ["cart_coulomb_friction", "cart_presliding_friction"]
    more = make_proposals(cart_presliding_friction=110.0, cart_coulomb_friction=99.0)
    assert list_contained(more[0], more) == []
    assert order_proposals(more)[0].effect == "cart_presliding_friction"


def test_the_best_of_several_starts_goes_on_alone() -> None:
    search = search_hidden(PATCH, 3)
    base = fit_parameters_alone(search)
    thetas = np.tile(base.theta, (3, 1))
    for theta, centre_m in zip(thetas, (-0.2, 0.06, 0.3), strict=True):
        theta[SLOTS["rail_friction_patch"]] = (0.5, centre_m, 0.1)
    several = search.fit_effects(("rail_friction_patch",), base, thetas)
    alone = search.fit_effects(("rail_friction_patch",), base, thetas[1])
    assert several.train == pytest.approx(alone.train, rel=1e-3) and several.train < 1.2


def test_what_the_pole_said_by_itself_is_taken_back() -> None:
    """With a wrong scale of the cart's way the pole by itself seems to hang in a spring."""
    search = search_hidden({"position_scale": {"ratio": -0.3}}, 1)
    base = fit_parameters_alone(search)
    spring = take_steps(search, base, ("pole_spring",))["pole_spring"]
    believed = Explanation(spring, PoleAnswer(search, base, spring, ()))
    assert believed.expected == ("pole_spring",)
    end = begin_otherwise(search, base, [], believed)
    assert end.fit.effects == ("position_scale",)
    assert end.expected == () and end.pole is None


def test_a_search_that_ended_at_the_noise_is_left_alone() -> None:
    search, base = search_tilt()
    steps = take_steps(search, base, ("rail_tilt", "cart_coulomb_friction"))
    known = Explanation(steps["rail_tilt"], None)
    assert begin_otherwise(search, base, list(steps.values()), known) is known


def test_another_end_that_leaves_more_than_noise_is_not_believed() -> None:
    recording, _ = record_hidden(TILT, 1, 20.0)
    signals = recording.signals
    shaken = replace(signals, cart=signals.cart + 1e-3 * np.sin(40.0 * signals.times_s))
    search = make_search(replace(recording, signals=shaken))
    base = fit_parameters_alone(search)
    steps = take_steps(search, base, ("gain_drift", "rail_tilt"))
    assert steps["rail_tilt"].choose < steps["gain_drift"].choose
    known = Explanation(steps["gain_drift"], None)
    assert begin_otherwise(search, base, list(steps.values()), known) is known


def test_a_rule_that_is_switched_off_begins_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    search, base = search_tilt()
    monkeypatch.setattr(decisions, "BEGIN_OTHERWISE", False)
    poor = Explanation(replace(base, choose=100.0), None)
    assert begin_otherwise(search, base, [], poor) is poor


def test_of_effects_that_contain_one_another_the_simplest_is_a_beginning() -> None:
    _, base = search_tilt()
    names = ("cart_stribeck_friction", "cart_coulomb_friction", "rail_friction_patch")
    steps = [replace(base, effects=(name,)) for name in names]
    assert [step.effects[-1] for step in list_simplest(steps)] == list(names[1:])
    assert [step.effects[-1] for step in list_simplest(steps, steps[:1])] == [names[2]]


@pytest.mark.parametrize(("effects", "turned"), [(WRONG_SIGN, True), (WRONG_SCALE, False)])
def test_a_sign_in_doubt_is_settled_by_what_a_search_comes_to(effects: dict, turned: bool) -> None:
    search = search_hidden(effects, 1)
    theta = make_theta(search.case.twin)
    mirrored_theta = theta.copy()
    mirrored_theta[SLOTS["angle_sign_inverted"]] = 1.0
    plain, mirrored = (
        fit(search.case, search.split, names, start, HORIZONS[0])
        for names, start in (((), theta), (("angle_sign_inverted",), mirrored_theta))
    )
    assert settle_sign(search, plain, [mirrored]) is (mirrored if turned else plain)


def test_the_journal_keeps_every_fit_in_order() -> None:
    search, base = search_tilt()
    count = len(search.journal.trials)
    search.journal.note(base, "kept")
    assert [trial.verdict for trial in search.journal.trials[count:]] == ["kept"]
    assert search.journal.trials[0].verdict == "parameters alone"
