"""Dry friction is certain where it is there all over every variable, and not told otherwise."""

from dataclasses import replace

import numpy as np
import pytest
from support.hidden_physics import INTECO, record_hidden
from support.made_recordings import made, without_joint

from pendulum_sysid.finding.detectors.detector import Reading, Sight
from pendulum_sysid.finding.detectors.steady_friction import combine_levels, read_friction
from pendulum_sysid.finding.localisation.measured_curves import MeasuredCurve
from pendulum_sysid.finding.localisation.questions import Measured, make_number_question
from pendulum_sysid.fitting.fit import fit
from pendulum_sysid.fitting.split import split_windows
from pendulum_sysid.prepare import prepare_case
from pendulum_sysid.records import Estimate, Recording
from pendulum_sysid.telling.verdict import describe_certain
from pendulum_twin.effects import BY_NAME
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import make_theta

LEVEL_N = 0.5
COULOMB = {"cart_coulomb_friction": {"level_n": LEVEL_N}}
PATCH = {"rail_friction_patch": {"level_n": 1.0, "centre_m": 0.05, "width_m": 0.05}}
COGGING = {"cogging": {"amplitude_n": 0.6, "period_m": 0.12, "phase_rad": 0.5}}
DRIFT = {"gain_drift": {"per_s": 0.01}}
LOAD = {"cart_load_friction": {"coefficient": 0.05}}
DRAG = {"cart_quadratic_drag": {"n_s2_m2": 2.0}}


def read(recording: Recording, twin: Twin = INTECO) -> tuple[Reading, ...]:
    """Return what the detector reads beside the rig's constants, fitted alone."""
    case = prepare_case([recording], twin)
    split = split_windows(case.signals, case.state)
    base = fit(case, split, tuple(case.twin.effects), make_theta(case.twin), 4)
    return read_friction(Sight(case, base.theta))


def measure_level(recording: Recording, twin: Twin = INTECO) -> Estimate | None:
    readings = read(recording, twin)
    return readings[0].estimates["level_n"] if readings else None


@pytest.mark.parametrize("other", [COGGING, DRIFT, DRAG], ids=["cogging", "drift", "drag"])
def test_the_level_is_measured_beside_other_physics_that_nobody_names(other: dict) -> None:
    level = measure_level(record_hidden({**COULOMB, **other}, 5, 40.0)[0])
    assert level is not None and level.value == pytest.approx(LEVEL_N, rel=0.25)
    assert 0.0 < level.low <= LEVEL_N <= level.high


@pytest.mark.parametrize(
    "other", [{}, PATCH, COGGING, DRAG], ids=["nothing", "patch", "cogging", "drag"]
)
def test_friction_that_is_not_there_everywhere_is_not_certain(other: dict) -> None:
    assert measure_level(record_hidden(other, 5, 40.0)[0]) is None


@pytest.mark.parametrize(("first", "certain"), [(0.9, True), (0.1, False)])
def test_a_single_end_of_a_curve_where_it_vanishes_is_enough_for_doubt(
    first: float, certain: bool
) -> None:
    flat, over_time = np.full(8, 1.0), np.array([first, *np.full(7, 1.0)])
    friction = Measured("dry friction", "N", "time")
    question = make_number_question(
        "cart_direction*time", "cart_velocity*time", "cart", friction, flat
    )
    levels = (flat, flat, over_time)
    curves = [MeasuredCurve(question, np.arange(8.0), level, np.full(8, 0.05)) for level in levels]
    assert (combine_levels(curves) is not None) == certain


def test_a_twin_that_has_dry_friction_is_not_asked() -> None:
    given = replace(INTECO, effects={"cart_coulomb_friction": {"level_n": 0.1}})
    assert measure_level(record_hidden(COULOMB, 5, 24.0)[0], given) is None


def test_without_a_cart_nothing_is_said() -> None:
    assert measure_level(without_joint(record_hidden(COULOMB, 5, 24.0)[0], "cart")) is None


@pytest.mark.parametrize("hidden", [COULOMB, LOAD], ids=["level", "load"])
def test_the_entry_leaves_open_which_law_of_dry_friction_it_is(hidden: dict) -> None:
    recording = record_hidden({**hidden, **DRAG}, 5, 40.0)[0]
    (reading,) = read(recording)
    entry = describe_certain(reading)
    level = reading.estimates["level_n"]
    parameter = entry.parameters["level_n"]
    assert (parameter.value, parameter.low, parameter.high) == (level.value, level.low, level.high)
    assert parameter.unit == "N"
    others = {"cart_stribeck_friction", "cart_saturating_friction", "cart_presliding_friction"}
    assert set(entry.cannot_be_told_from) == {*others, "cart_load_friction"}
    sentence = BY_NAME["cart_coulomb_friction"].sentence
    assert entry.sentence == sentence.format(level_n=f"{level.value:.3g} N")


def test_without_a_pole_the_load_is_constant() -> None:
    pole = ("pole_mass_kg", "com_distance_m", "pole_inertia_kg_m2", "pole_viscous_n_m_s")
    cart = Twin("cart", replace(INTECO.rig, **dict.fromkeys(pole)))
    rig = replace(cart, effects={**COULOMB, **COGGING})
    (reading,) = read(without_joint(made(rig, 40.0, 0.6), "pole"), cart)
    assert reading.effect == "cart_coulomb_friction"
    assert "cart_load_friction" not in reading.inseparable_from
