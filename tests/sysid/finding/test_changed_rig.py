"""A rig that changed between its recordings is told as such, and gets no name for the change."""

from dataclasses import replace

import pytest
from support.made_recordings import INTECO, made
from support.tied_recordings import RIG

from pendulum_sysid.pipeline import diagnose
from pendulum_sysid.records import Outcome
from pendulum_sysid.verdict.record import Verdict
from pendulum_twin.effects.load_put_on import put_load_on
from pendulum_twin.model import Twin
from pendulum_twin.rig import Rig

DRY = {"cart_coulomb_friction": {"level_n": 0.4}}
LOADED = put_load_on(RIG, 0.17, 0.0)
TIGHT = replace(RIG, cart_viscous_n_s_m=3.15)


def diagnose_pair(first: Rig, second: Rig, effects: dict[str, dict[str, float]]) -> Verdict:
    return diagnose_twins(Twin("made", first, effects), Twin("made", second, effects))


def diagnose_twins(*twins: Twin) -> Verdict:
    recordings = [made(twin, 20.0, 0.25, seed) for seed, twin in enumerate(twins)]
    return diagnose(recordings, INTECO, lambda line: None)


def test_a_load_put_on_between_recordings_has_its_size() -> None:
    verdict = diagnose_pair(RIG, LOADED, {})
    assert verdict.outcome is Outcome.NOT_IN_CATALOGUE and not verdict.unlike_rig
    assert not verdict.missing_physics and not verdict.measured_laws and not verdict.perhaps
    assert verdict.sentence.startswith("The rig changed between the recordings: each by itself")
    assert "All constants change by the same factor" in verdict.sentence
    assert "a load of 0.17 kg is put on the cart" in verdict.sentence
    assert verdict.rig_changed and verdict.next_experiment is None
    force = verdict.rig_parameters["force_per_pwm_n"]
    loaded = RIG.force_per_pwm_n * RIG.total_mass_kg / LOADED.total_mass_kg
    assert force.low < loaded < RIG.force_per_pwm_n < force.high


@pytest.mark.long
def test_a_single_constant_that_changed_is_listed() -> None:
    verdict = diagnose_pair(RIG, TIGHT, {})
    assert not verdict.missing_physics and not verdict.perhaps
    assert "In recording 1 and recording 2: cart_viscous_n_s_m 2.1" in verdict.sentence
    assert "and 3.1" in verdict.sentence and "same factor" not in verdict.sentence


def test_physics_that_both_recordings_need_is_no_change() -> None:
    verdict = diagnose_pair(RIG, RIG, DRY)
    assert verdict.outcome in (Outcome.NAMED, Outcome.AMBIGUOUS)
    assert "changed between" not in verdict.sentence


@pytest.mark.long
def test_a_change_beside_friction_is_told_too() -> None:
    verdict = diagnose_pair(RIG, LOADED, DRY)
    assert "The rig changed between the recordings" in verdict.sentence
    allowed = {"cart_coulomb_friction", "cart_load_friction", "cart_stribeck_friction"}
    assert {effect.effect for effect in verdict.missing_physics} <= allowed


def test_friction_of_the_pole_that_changed_shows_over_whole_windows() -> None:
    """Pieces of windows end at the noise all the same."""
    verdict = diagnose_pair(RIG, replace(RIG, pole_viscous_n_m_s=2 * RIG.pole_viscous_n_m_s), {})
    assert "In recording 1 and recording 2: pole_viscous_n_m_s 0.00026" in verdict.sentence
    assert "same factor" not in verdict.sentence and not verdict.missing_physics


def test_a_given_twin_that_stays_is_the_twin_of_the_verdict() -> None:
    """The given twin is right for the first recording, and far ahead there."""
    given = Twin("made", RIG)
    rigs = enumerate((RIG, LOADED))
    recordings = [made(replace(given, rig=rig), 20.0, 0.25, seed) for seed, rig in rigs]
    verdict = diagnose(recordings, given, lambda line: None)
    assert verdict.rig_changed and verdict.given_stays and verdict.twin is not None
    assert verdict.twin.rig == RIG


@pytest.mark.long
def test_a_change_that_leads_the_search_of_all_astray_is_told() -> None:
    """All together end at a law along the rail, and each by itself at dry friction."""
    more = {"cart_coulomb_friction": {"level_n": 0.8}}
    verdict = diagnose_twins(Twin("made", RIG, DRY), Twin("made", RIG, more))
    assert verdict.rig_changed and "cart_coulomb_friction.level_n 0." in verdict.sentence
    assert "viscous" not in verdict.sentence and not verdict.measured_laws


@pytest.mark.long
@pytest.mark.parametrize("effects", [{}, DRY])
def test_an_encoder_that_was_zeroed_anew_is_told(effects: dict[str, dict[str, float]]) -> None:
    offset = {"angle_offset": {"angle_rad": -0.03}}
    verdict = diagnose_twins(Twin("made", RIG, effects), Twin("made", RIG, {**effects, **offset}))
    assert verdict.rig_changed and "angle_offset.angle_rad" in verdict.sentence
    assert "-0.03" in verdict.sentence and "same factor" not in verdict.sentence
    assert {effect.effect for effect in verdict.missing_physics} <= set(effects)
