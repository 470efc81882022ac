"""Ties from sensitivities: what is far apart, what is tied, and how far a refit finds it."""

from dataclasses import replace

import numpy as np
import pytest
from support.hidden_physics import HIDDEN, record_hidden
from support.tied_recordings import (
    INTECO,
    fit_recordings,
    make_gentle_sweep,
    make_hidden_twin,
    record_twin,
)

from pendulum_sysid import decisions
from pendulum_sysid.finding.exchange import refit_tie, screen_effects
from pendulum_sysid.finding.hypotheses import EffectShape, list_possible_effects
from pendulum_sysid.finding.identifiability import find_ties, make_question
from pendulum_sysid.finding.separation import ColumnProducts, compute_rest, is_rival
from pendulum_sysid.fitting.fit import fit
from pendulum_sysid.fitting.parameters import list_free_parameters
from pendulum_twin.effects import BY_NAME, CATALOGUE
from pendulum_twin.parameter_vector import SIZE

DELAY = make_hidden_twin({"input_delay": {"delay_s": 0.01}})
SLOW = make_gentle_sweep(8, 0.05)


@pytest.mark.parametrize(
    "name",
    ["input_dead_zone", "motor_lag", "cart_coulomb_friction", "rail_tilt", "pole_quadratic_drag"],
)
def test_a_rich_recording_ties_nothing_that_motion_can_part(name: str) -> None:
    recording, truth = record_hidden({name: HIDDEN[name]}, seed=1, seconds=20.0)
    ties = find_ties(*fit_recordings([recording], truth))
    assert all(tie.by_no_motion for tie in ties)


@pytest.mark.parametrize("other", ["friction_warming", "rail_friction_patch"])
def test_what_becomes_an_effect_at_an_end_of_its_range_is_no_rival(other: str) -> None:
    """Dry friction was told to be tied with a friction that warms up ever more slowly."""
    friction = BY_NAME["cart_coulomb_friction"]
    assert not is_rival(BY_NAME[other], friction, ())
    assert is_rival(friction, BY_NAME[other], ())


def test_a_slow_recording_ties_delay_and_lag_in_both_directions() -> None:
    for effects in (DELAY.effects, {"motor_lag": {"time_constant_s": 0.01}}):
        truth = make_hidden_twin(dict(effects))
        (name,) = effects
        near = {
            tie.rival: tie
            for tie in find_ties(*fit_recordings([record_twin(truth, SLOW)], truth))
            if not tie.by_no_motion
        }
        assert set(near) == {"input_delay", "motor_lag"} - {name}
        assert all(0 <= tie.distance < decisions.APART_STANDARD_ERRORS for tie in near.values())


def test_the_distance_is_what_a_fit_of_the_rival_loses() -> None:
    """Twice the loss of log likelihood has the square of the distance as its mean."""
    truth = make_hidden_twin({"input_delay": {"delay_s": 0.02}})
    case, split, best = fit_recordings([record_twin(truth, make_gentle_sweep(12, 0.1))], truth)
    question = make_question(case, split, best, "input_delay")
    (tie,) = (
        refit_tie(question, tie)
        for tie in screen_effects(question, [BY_NAME["motor_lag"]])
        if tie.rival
    )
    rival = fit(case, split, ("motor_lag",), tie.theta, 1)
    lost = (split.train.samples * len(split.train)) * np.sum(np.log(rival.power / best.power))
    share = len(split.train) / (len(split.train) + len(split.choose))
    assert tie.distance > decisions.APART_STANDARD_ERRORS
    assert np.sqrt(lost) == pytest.approx(np.sqrt(share) * tie.distance, rel=0.25)


def test_a_tie_s_theta_is_where_a_fit_of_the_rival_ends() -> None:
    case, split, best = fit_recordings([record_twin(DELAY, SLOW)], DELAY)
    (tie,) = (tie for tie in find_ties(case, split, best) if tie.rival == "motor_lag")
    there = fit(case, split, ("motor_lag",), tie.theta, 1)
    for name in ("cart_viscous_n_s_m", "force_per_pwm_n", "motor_lag.time_constant_s"):
        estimate = there.estimates[name]
        free = next(
            f
            for f in list_free_parameters(case.twin, ("motor_lag",), case.scales)
            if f.name == name
        )
        assert abs(free.get(tie.theta) - estimate.value) < estimate.high - estimate.low


def test_dry_friction_that_differs_by_direction_is_a_tilt_where_the_cart_never_rests() -> None:
    """A large step of either is no sum of small ones: from afar the two seem far apart."""
    truth = make_hidden_twin(
        {"cart_coulomb_friction": {"level_n": 0.3}, "rail_tilt": {"angle_rad": 0.005}}
    )
    case, split, best = fit_recordings([record_twin(truth, make_gentle_sweep(12, 0.12))], truth)
    near = {(tie.effect, tie.rival): tie.distance for tie in find_ties(case, split, best)}
    assert near[("rail_tilt", "cart_friction_asymmetry")] < decisions.APART_STANDARD_ERRORS


def test_what_no_motion_parts_stands_beside_what_is_named() -> None:
    case, split, best = fit_recordings([record_twin(DELAY, SLOW)], DELAY)
    never = [tie for tie in find_ties(case, split, best) if tie.by_no_motion]
    assert [(tie.effect, tie.rival, tie.distance) for tie in never] == [
        ("input_delay", "sensor_delay", 0.0)
    ]


def test_an_effect_that_contains_the_named_one_is_no_rival_but_what_it_contains_is() -> None:
    truth = make_hidden_twin({"cart_coulomb_friction": {"level_n": 0.3}})
    question = make_question(
        *fit_recordings([record_twin(truth, SLOW)], truth), "cart_coulomb_friction"
    )
    rivals = {tie.rival for tie in screen_effects(question, list_possible_effects(INTECO.rig))}
    assert "rail_tilt" in rivals
    assert {
        "cart_stribeck_friction",
        "cart_saturating_friction",
        "cart_coulomb_friction",
    }.isdisjoint(rivals)
    hardly = make_hidden_twin(
        {"cart_stribeck_friction": {"level_n": 0.3, "static_n": 2e-4, "velocity_m_s": 0.02}}
    )
    near = {tie.rival for tie in find_ties(*fit_recordings([record_twin(hardly, SLOW)], hardly))}
    assert "cart_coulomb_friction" in near


def test_an_effect_that_is_not_there_is_tied_to_the_rig_s_constants() -> None:
    """Nothing is question of its rivals then: anything could take its place."""
    recording, truth = record_hidden({}, seed=1, seconds=20.0)
    given = replace(truth, effects={"cart_quadratic_drag": {"n_s2_m2": 0.01}})
    (tie,) = find_ties(*fit_recordings([recording], given))
    assert (tie.effect, tie.rival) == (
        "cart_quadratic_drag",
        None,
    ) and tie.distance < decisions.APART_STANDARD_ERRORS


def test_rivals_of_the_scores_are_tied_only_where_a_fit_does_not_part_them_clearly() -> None:
    also = {"input_delay": ("motor_lag",)}
    truth = make_hidden_twin({"input_delay": {"delay_s": 0.015}})
    case, split, best = fit_recordings([record_twin(truth, SLOW)], truth)
    assert [tie.rival for tie in find_ties(case, split, best) if not tie.by_no_motion] == []
    (tie,) = (tie for tie in find_ties(case, split, best, also) if not tie.by_no_motion)
    assert tie.rival == "motor_lag" and tie.distance > decisions.APART_STANDARD_ERRORS
    recording, truth = record_hidden({"input_delay": HIDDEN["input_delay"]}, seed=1, seconds=12.0)
    assert [
        tie.rival
        for tie in find_ties(*fit_recordings([recording], truth), also)
        if not tie.by_no_motion
    ] == []


def test_effects_that_the_given_twin_holds_are_not_asked_about() -> None:
    case, split, best = fit_recordings([record_twin(DELAY, SLOW)], DELAY)
    assert find_ties(replace(case, twin=DELAY), split, best) == ()


def columns_of(vectors: np.ndarray, one_way: bool, on_or_off: bool) -> ColumnProducts:
    """Return columns of a shape (the first vector) and a target (the second), nothing free."""
    effect = BY_NAME["input_sign_inverted" if on_or_off else "rail_tilt"]
    nothing = np.zeros(SIZE)
    shape = EffectShape(effect, nothing, nothing[None], (one_way,), np.empty((0, SIZE)), ())
    return ColumnProducts(vectors @ vectors.T, (), (shape,), (0,), 1)


def test_what_a_rival_takes_is_a_projection_and_keeps_its_sign() -> None:
    along, across = np.array([3.0, 0.0]), np.array([-3.0, 4.0])
    question = np.array([0.0, 1.0])
    vectors = np.array([along, across])
    assert compute_rest(columns_of(vectors, False, False), question, 0).distance == pytest.approx(
        4.0
    )
    assert compute_rest(columns_of(vectors, True, False), question, 0).distance == pytest.approx(
        5.0
    )  # it cannot turn round
    assert compute_rest(columns_of(vectors, True, True), question, 0).distance == pytest.approx(
        np.hypot(6.0, 4.0)
    )  # all or nothing


def test_twins_that_lie_apart_are_ahead_by_the_lead_that_is_asked_for() -> None:
    """Of two twins d apart, the right one is ahead by d/2 standard errors in the mean."""
    assert decisions.APART_STANDARD_ERRORS == 2 * decisions.LEAD_STANDARD_ERRORS


def test_what_shows_as_something_else_does_so_within_the_catalogue() -> None:
    assert all(effect.shows_as in BY_NAME for effect in CATALOGUE if effect.shows_as is not None)


def test_nothing_tied_without_effects() -> None:
    assert (
        find_ties(*fit_recordings([record_twin(make_hidden_twin({}), SLOW)], make_hidden_twin({})))
        == ()
    )
    assert INTECO.effects == {}
