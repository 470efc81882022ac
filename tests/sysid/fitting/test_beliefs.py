"""Constants that are known stay; constants with a spread follow it and the recording."""

from dataclasses import replace

import numpy as np
import pytest
from support.made_recordings import INTECO, made

from pendulum_sysid.api import diagnose
from pendulum_sysid.api import fit as fit_to
from pendulum_sysid.errors import WrongUse
from pendulum_sysid.finding.journal import Search
from pendulum_sysid.finding.replication import replicate_effects
from pendulum_sysid.finding.subsets import find_subsets
from pendulum_sysid.fitting.fit import HORIZONS, fit, fit_own_parameters
from pendulum_sysid.fitting.parameters import hold_constants, list_rig_parameters
from pendulum_sysid.prepare import prepare, prepare_case
from pendulum_sysid.verbs.fit import fit_by_windows
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin, parse_twin
from pendulum_twin.parameter_vector import make_theta

HEAVY = replace(INTECO, rig=replace(INTECO.rig, cart_mass_kg=2.0, com_distance_m=0.0064))


def give_spreads(twin: Twin, **spreads: float) -> Twin:
    mapping = twin.to_mapping()
    for key, sd in spreads.items():
        mapping["rig"][key] = {"value": mapping["rig"][key], "sd": sd}
    return parse_twin(mapping)


def test_a_held_constant_is_no_parameter_of_a_fit() -> None:
    names = [p.name for p in list_rig_parameters(hold_constants(INTECO, ("com_distance_m",)))]
    assert "com_distance_m" not in names and "pole_inertia_kg_m2" in names
    assert list_rig_parameters(hold_constants(INTECO, ("all",))) == ()
    with pytest.raises(WrongUse, match="expected constants that a fit changes"):
        hold_constants(INTECO, ("rail_half_length_m",))


def test_a_text_is_the_name_of_a_single_constant() -> None:
    assert INTECO.hold("com_distance_m") == INTECO.hold(["com_distance_m"])
    assert hold_constants(INTECO, "com_distance_m") == hold_constants(INTECO, ["com_distance_m"])
    assert hold_constants(INTECO, "all") == hold_constants(INTECO, ("all",))
    with pytest.raises(BadInputError, match="pole_length_m"):
        INTECO.hold("pole_length_m")
    with pytest.raises(WrongUse, match="found 'pole_length_m'"):
        hold_constants(INTECO, "pole_length_m")


def test_a_narrow_spread_keeps_a_wrong_value_and_a_wide_spread_gives_way() -> None:
    wrong = replace(INTECO, rig=replace(INTECO.rig, pole_inertia_kg_m2=0.0032))
    recording = made(INTECO, 20.0, 0.2)
    fitted = {}
    for sd in (1e-7, 1e-2):
        prepared = prepare([recording], give_spreads(wrong, pole_inertia_kg_m2=sd))
        fitted[sd] = fit_own_parameters(prepared.case, prepared.split).twin.rig
    assert fitted[1e-7].pole_inertia_kg_m2 == pytest.approx(0.0032, rel=1e-3)
    assert fitted[1e-2].pole_inertia_kg_m2 == pytest.approx(0.00292, rel=2e-2)


def test_a_fitted_twin_keeps_what_is_known_and_forgets_what_was_believed() -> None:
    """A belief that has gone into a fit would count twice in the next fit."""
    twin = give_spreads(INTECO, pole_inertia_kg_m2=1e-4).hold(["pole_viscous_n_m_s"])
    prepared = prepare([made(INTECO, 20.0, 0.2)], twin)
    fitted = fit_own_parameters(prepared.case, prepared.split).twin
    assert fitted.spreads == {"pole_viscous_n_m_s": 0.0}
    assert fitted.rig.pole_viscous_n_m_s == INTECO.rig.pole_viscous_n_m_s


def test_a_heavier_cart_is_said_and_not_a_pole_that_a_ruler_contradicts() -> None:
    verdict = diagnose(made(HEAVY, 20.0, 0.45), INTECO)
    (constant,) = [warning for warning in verdict.warnings if "instead of" in warning]
    assert "cart of 2 kg" in constant


@pytest.mark.parametrize(
    "known",
    [("com_distance_m", "pole_inertia_kg_m2"), ("com_distance_m",), ("pole_inertia_kg_m2",)],
)
def test_a_known_pole_parts_a_wrong_clock_from_a_wrong_scale(known: tuple[str, ...]) -> None:
    """The scale moves as the clock does only with another distance and another inertia."""
    recording = made(INTECO, 20.0, 0.45)
    short = replace(recording.signals, period_s=0.95 * recording.signals.period_s)
    verdict = diagnose(replace(recording, signals=short), INTECO, hold=known)
    (missing,) = verdict.missing_physics
    assert missing.effect == "sample_period_error" and missing.cannot_be_told_from == ()
    ratio = missing.parameters["ratio"]
    assert ratio.low <= ratio.value <= ratio.high
    assert ratio.value == pytest.approx(-0.05, abs=0.0005)


def test_without_a_known_pole_a_wrong_clock_or_a_wrong_scale_is_named() -> None:
    recording = made(INTECO, 20.0, 0.45)
    short = replace(recording.signals, period_s=0.95 * recording.signals.period_s)
    (missing,) = diagnose(replace(recording, signals=short), INTECO).missing_physics
    assert {missing.effect, *missing.cannot_be_told_from} == {
        "position_scale",
        "sample_period_error",
    }


def test_a_known_pole_leaves_a_wrong_scale_a_wrong_scale() -> None:
    recording = made(INTECO, 20.0, 0.3)
    assert recording.signals.cart is not None
    longer = replace(recording.signals, cart=1.05 * recording.signals.cart)
    known = ("com_distance_m", "pole_inertia_kg_m2")
    verdict = diagnose(replace(recording, signals=longer), INTECO, hold=known)
    (missing,) = verdict.missing_physics
    assert missing.effect == "position_scale" and missing.cannot_be_told_from == ()
    assert missing.parameters["ratio"].value == pytest.approx(0.05, abs=0.002)


def test_with_spreads_the_cart_takes_the_mass() -> None:
    believed = give_spreads(INTECO, cart_mass_kg=1.0, com_distance_m=1e-4, pole_inertia_kg_m2=2e-5)
    prepared = prepare([made(HEAVY, 20.0, 0.45)], believed)
    fitted = fit_own_parameters(prepared.case, prepared.split)
    assert fitted.twin.rig.cart_mass_kg == pytest.approx(2.0, rel=0.05)
    assert fitted.twin.rig.pole_inertia_kg_m2 == pytest.approx(0.00292, rel=0.02)
    moment = fitted.twin.rig.moment_kg_m
    assert moment == pytest.approx(HEAVY.rig.moment_kg_m, rel=0.02)


def test_the_distance_that_a_fit_prints_is_that_of_its_twin() -> None:
    """It was of the given masses in the table, and of the fitted masses in the file."""
    believed = give_spreads(INTECO, cart_mass_kg=1.0)
    fitted = fit_by_windows(prepare_case([made(HEAVY, 20.0, 0.45)], believed), lambda line: None)
    assert fitted.twin.rig.cart_mass_kg != pytest.approx(INTECO.rig.cart_mass_kg, rel=0.01)
    for name, estimate in fitted.mapping["parameters"].items():
        assert estimate["value"] == pytest.approx(getattr(fitted.twin.rig, name))
        assert estimate["low"] <= estimate["value"] <= estimate["high"]


def test_the_distance_that_a_fit_returns_is_that_of_its_twin() -> None:
    """`ps.fit` and the fleet's table gave it with the given masses."""
    fitted = fit_to([made(HEAVY, 20.0, 0.45)], give_spreads(INTECO, cart_mass_kg=1.0))
    assert fitted.twin.rig.cart_mass_kg != pytest.approx(INTECO.rig.cart_mass_kg, rel=0.01)
    for name, estimate in fitted.estimates.items():
        assert estimate.value == pytest.approx(getattr(fitted.twin.rig, name))


def test_what_is_believed_of_the_mass_holds_when_sets_are_tried_and_in_each_third() -> None:
    """All masses and forces together may grow by any factor: the motion does not tell."""
    rubbing = replace(INTECO, effects={"cart_coulomb_friction": {"level_n": 0.4}})
    prepared = prepare([made(rubbing, 20.0, 0.2)], give_spreads(INTECO, cart_mass_kg=0.006))
    search = Search(prepared.case, prepared.split)
    base = fit(search.case, search.split, (), make_theta(prepared.case.twin), HORIZONS[0])
    subsets = find_subsets(search, base, 1)
    assert subsets
    for subset in subsets:
        (mass,) = [p for p in list_rig_parameters(prepared.case.twin) if p.name == "cart_mass_kg"]
        assert mass.get(subset.theta) == pytest.approx(mass.get(base.theta), rel=0.02)
    theta = make_theta(replace(prepared.case.twin, effects=rubbing.effects))
    named = fit(search.case, search.split, tuple(rubbing.effects), theta, HORIZONS[0])
    replications = replicate_effects(search.case, search.split, named)
    assert str(replications["cart_coulomb_friction"]) == "3 of 3"


def test_a_twin_file_keeps_its_spreads() -> None:
    twin = give_spreads(INTECO, cart_mass_kg=0.1)
    assert parse_twin(twin.to_mapping()) == twin
    assert twin.to_mapping()["rig"]["cart_mass_kg"] == {"value": 0.5723, "sd": 0.1}


@pytest.mark.parametrize("entry", [{"spread": 1.0}, {"sd": -1.0}, {"sd": np.nan}, {}])
def test_a_wrong_spread_is_refused(entry: dict[str, float]) -> None:
    mapping = INTECO.to_mapping()
    mapping["rig"]["cart_mass_kg"] = {"value": 0.5723, **entry} if entry else entry
    with pytest.raises(BadInputError, match="cart_mass_kg"):
        parse_twin(mapping)
