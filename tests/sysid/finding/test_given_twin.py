"""The given twin stays where no other twin runs left-out windows better for sure."""

from dataclasses import replace

import numpy as np
import pytest
from support.made_recordings import INTECO, made

from pendulum_sysid.api import diagnose
from pendulum_sysid.finding.given_twin import is_surely_behind
from pendulum_sysid.fitting.window_runs import WindowRuns
from pendulum_sysid.records import Outcome
from pendulum_twin.arrays import Floats
from pendulum_twin.model import Twin


def change_constants(factor: float) -> Twin:
    """Return the thesis rig with the pole's constants and the force wrong by a factor."""
    rig = INTECO.rig
    return replace(
        INTECO,
        rig=replace(
            rig,
            force_per_pwm_n=factor * rig.force_per_pwm_n,
            pole_inertia_kg_m2=factor * rig.pole_inertia_kg_m2,
        ),
    )


@pytest.mark.long
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_the_true_twin_stays_bit_for_bit_and_a_wrong_twin_does_not(seed: int) -> None:
    recording = made(INTECO, 20.0, 0.2, seed=seed)
    verdict = diagnose(recording, INTECO)
    assert verdict.outcome is Outcome.NOTHING_MISSING and verdict.given_stays
    assert verdict.twin == INTECO and verdict.twin.to_mapping() == INTECO.to_mapping()
    assert verdict.fit is not None
    assert verdict.fit.held_out.before == verdict.fit.held_out.after
    assert verdict.sentence.startswith("Nothing is missing: the given twin stays")
    constant = verdict.rig_parameters["pole_inertia_kg_m2"]
    assert constant.low < constant.after < constant.high and constant.identifiable

    better = diagnose(recording, change_constants(1.03))
    assert better.outcome is Outcome.NOTHING_MISSING and not better.given_stays
    assert better.twin is not None and better.fit is not None
    assert better.twin.rig.pole_inertia_kg_m2 == pytest.approx(
        INTECO.rig.pole_inertia_kg_m2, rel=2e-3
    )
    assert better.fit.held_out.after < better.fit.held_out.before


def test_a_refit_that_is_a_little_better_for_sure_stays() -> None:
    recording = made(INTECO, 20.0, 0.2)
    verdict = diagnose(recording, change_constants(1.003))
    assert not verdict.given_stays and verdict.fit is not None
    assert verdict.fit.held_out.after < verdict.fit.held_out.before


def test_what_is_missing_leads_over_the_given_twin() -> None:
    rubbing = replace(INTECO, effects={"cart_coulomb_friction": {"level_n": 0.4}})
    verdict = diagnose(made(rubbing, 20.0, 0.2), INTECO)
    assert verdict.outcome is Outcome.NAMED and not verdict.given_stays
    assert [m.effect for m in verdict.missing_physics] == ["cart_coulomb_friction"]
    given = replace(rubbing, name=INTECO.name)
    again = diagnose(made(rubbing, 20.0, 0.2), given)
    assert again.given_stays and again.twin == given
    level = again.effect_parameters["cart_coulomb_friction.level_n"]
    assert level.before == 0.4 and level.low < level.after < level.high


def make_runs(errors: Floats) -> WindowRuns:
    """Return runs of windows with these errors (windows, samples) of a cart, 1 m of noise."""
    zero = np.zeros((*errors.shape, 1))
    begin = np.arange(len(errors), dtype=float)
    return WindowRuns((0,), begin, 0.01, zero, errors[..., None], zero + 1.0, np.ones(1))


@pytest.mark.parametrize(
    ("factor", "behind"), [(1.5, True), (1.0, False), (0.7, False), (np.inf, True)]
)
def test_larger_errors_in_all_blocks_are_no_chance(factor: float, behind: bool) -> None:
    errors = np.random.default_rng(0).normal(size=(24, 100))
    larger = factor * np.abs(errors)
    assert is_surely_behind(make_runs(larger), make_runs(errors)) is behind


def test_a_single_wild_window_is_chance() -> None:
    errors = np.random.default_rng(0).normal(size=(24, 100))
    wild = errors.copy()
    wild[3] *= 100.0
    assert not is_surely_behind(make_runs(wild), make_runs(errors))
    assert not is_surely_behind(make_runs(wild[:1]), make_runs(errors[:1]))
