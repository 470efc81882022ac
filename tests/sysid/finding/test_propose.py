"""Proposals: what is hidden stands near the top before anything has been refitted."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from support.hidden_physics import HIDDEN, INTECO, record_hidden
from support.made_recordings import PERIOD_S, made_states, sweep, without_joint

from pendulum_sysid import decisions
from pendulum_sysid.finding.detectors import detector
from pendulum_sysid.finding.propose import Proposal, list_probes, propose
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.fit import HORIZONS, fit
from pendulum_sysid.fitting.split import split_windows
from pendulum_sysid.prepare import prepare_case
from pendulum_sysid.records import Fit, Recording, Split
from pendulum_twin.effects import BY_NAME
from pendulum_twin.effects.effect import Form, Place
from pendulum_twin.parameter_vector import SLOTS, make_theta
from pendulum_twin.signals import Signals

WITH_SIZES = [
    name for name, sizes in HIDDEN.items() if sizes and BY_NAME[name].form is not Form.REPORT
]
FRICTION = "cart_coulomb_friction"


def fit_alone(recording: Recording) -> tuple[Case, Split, Fit]:
    case = prepare_case([recording], INTECO)
    split = split_windows(case.signals, case.state)
    return case, split, fit(case, split, (), make_theta(case.twin), HORIZONS[0])


@cache
def fit_hidden(name: str, seed: int) -> tuple[Case, Split, Fit]:
    """Return the fit of parameters alone to a rig that hides an effect; an empty name for none."""
    return fit_alone(record_hidden({name: HIDDEN[name]} if name else {}, seed, 20.0)[0])


@cache
def propose_hidden(name: str, seed: int) -> list[Proposal]:
    return propose(*fit_hidden(name, seed))


@pytest.mark.long
def test_what_is_hidden_is_ranked_first_or_second() -> None:
    ranks = {}
    for name in WITH_SIZES:
        order = [proposal.effect for proposal in propose_hidden(name, 1)]
        ranks[name] = order.index(name) + 1
    near_the_top = [name for name, rank in ranks.items() if rank <= 2]
    assert len(near_the_top) >= 0.8 * len(ranks), ranks
    assert max(ranks.values()) <= decisions.CANDIDATES_REFITTED, ranks


def test_detectors_share_the_balance_that_they_ask(monkeypatch: pytest.MonkeyPatch) -> None:
    case, _, alone = fit_hidden("", 1)
    calls = []
    make_balance = detector.make_balance
    monkeypatch.setattr(
        detector, "make_balance", lambda *given: calls.append(given) or make_balance(*given)
    )
    list_probes(case, alone)
    assert len(calls) == 1


def test_where_nothing_is_missing_little_is_promised() -> None:
    assert propose_hidden("", 1)[0].gain < 10 < 100 < propose_hidden(FRICTION, 1)[0].gain


@pytest.mark.parametrize("name", [FRICTION, "input_delay", "angle_offset"])
def test_a_proposal_promises_a_start_near_the_truth(name: str) -> None:
    proposal = next(p for p in propose_hidden(name, 2) if p.effect == name)
    case, split, _ = fit_hidden(name, 2)
    after = fit(case, split, proposal.effects, proposal.theta[0], HORIZONS[0])
    ((parameter, true),) = HIDDEN[name].items()
    assert after.estimates[f"{name}.{parameter}"].value == pytest.approx(true, rel=0.1)


def test_a_resonance_starts_at_its_probes_too() -> None:
    """A share of the probe's period is the period of another resonance, and leads astray."""
    belt, tilt = (
        next(p for p in propose_hidden("rail_tilt", 1) if p.effect == name)
        for name in ("stretching_belt", "rail_tilt")
    )
    period = SLOTS["stretching_belt"].start
    assert {0.06, 0.12, 0.25} <= set(belt.theta[:, period]) and len(belt.theta) == 6
    assert len(tilt.theta) == 1


def test_every_candidate_once_the_most_promising_first() -> None:
    proposals = propose_hidden("rail_tilt", 1)
    names, gains = [p.effect for p in proposals], [p.gain for p in proposals]
    assert len(names) == len(set(names)) and gains == sorted(gains, reverse=True)
    assert all(BY_NAME[name].searched and BY_NAME[name].parameters for name in names)
    assert all(p.theta.shape[0] >= 1 and np.all(np.isfinite(p.theta)) for p in proposals)


def test_what_is_held_is_not_proposed_again_and_ratios_only_beside_dry_friction() -> None:
    case, split, _ = fit_hidden(FRICTION, 1)
    before = propose_hidden(FRICTION, 1)
    assert "cart_friction_asymmetry" not in [proposal.effect for proposal in before]
    start = next(proposal for proposal in before if proposal.effect == FRICTION)
    after_step = fit(case, split, start.effects, start.theta[0], HORIZONS[0])
    after = {proposal.effect: proposal for proposal in propose(case, split, after_step)}
    assert FRICTION not in after and "cart_friction_asymmetry" in after
    in_place_of_the_simpler = ("cart_stribeck_friction",)
    assert after["cart_stribeck_friction"].effects == in_place_of_the_simpler
    assert max(proposal.gain for proposal in after.values()) < 0.1 * start.gain


@pytest.mark.parametrize(
    ("gone", "places"),
    [("pole", {Place.COMMAND, Place.DRIVE, Place.CART}), ("cart", {Place.POLE, Place.SENSOR})],
)
def test_only_what_the_rig_can_have_is_proposed(gone: str, places: set[Place]) -> None:
    proposals = propose(*fit_alone(without_joint(record_hidden({}, 1, 20.0)[0], gone)))
    assert {BY_NAME[proposal.effect].place for proposal in proposals} == places
    assert "position_scale" not in [proposal.effect for proposal in proposals]


def test_a_limit_far_below_the_largest_command_is_near_a_start() -> None:
    """A controller that logs the commands that it wants asks for many times what the drive has."""
    pushes = np.sin(2 * np.pi * 0.11 * PERIOD_S * np.arange(3000)) > 0.5
    command = sweep(30.0, 0.05) + 0.45 * pushes * np.sign(sweep(30.0, 1.0))
    states = made_states(replace(INTECO, effects={"input_saturation": {"limit": 0.08}}), command)
    noise, every = np.random.default_rng(0).normal(size=(2, 3000)), np.ones(3000, dtype=bool)
    cart, pole = states[:, 0] + 5e-5 * noise[0], states[:, 1] + 1e-3 * noise[1]
    signals = Signals(PERIOD_S, command, cart, pole, every, every)
    proposals = propose(*fit_alone(Recording("made", "sha256:0", signals)))
    clipped = next(p for p in proposals if p.effect == "input_saturation")
    limits = clipped.theta[:, SLOTS["input_saturation"].start]
    assert np.min(np.abs(np.log(limits / 0.08))) < np.log(1.5)
