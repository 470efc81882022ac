"""Physics beyond the names that were tried, on the independent engine: located, never misnamed."""

from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np
import pytest
from support.hidden_physics import record_hidden
from support.made_recordings import INTECO

from pendulum_bridge.emulator.rig import EmulatedRig
from pendulum_bridge.emulator.seal import Concealed
from pendulum_bridge.emulator.sensors import Encoders
from pendulum_bridge.emulator.session import play_plan
from pendulum_sysid import decisions
from pendulum_sysid.finding.journal import Search
from pendulum_sysid.finding.localisation.inspection import inspect_twin
from pendulum_sysid.finding.localisation.localise import localise
from pendulum_sysid.finding.localisation.shape_check import (
    find_wrong_shapes,
    measure_remainders,
)
from pendulum_sysid.finding.signs import fit_parameters_alone
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.fit import fit
from pendulum_sysid.fitting.split import split_windows
from pendulum_sysid.fitting.window_runs import run_windows
from pendulum_sysid.fitting.windows import WINDOW_S, cut_windows
from pendulum_sysid.prepare import prepare_case
from pendulum_sysid.records import Fit, Localisation, Recording
from pendulum_twin.effects import BY_NAME
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import make_theta
from pendulum_twin.plans.excitation import make_standard_plan
from pendulum_twin.signals import Signals

RIG = replace(
    INTECO.rig,
    force_per_pwm_n=11.2,
    cart_viscous_n_s_m=0.57,
    pole_viscous_n_m_s=0.0003,
    pole_inertia_kg_m2=0.0026,
)


Sizes = dict[str, dict[str, float]]  # effect -> parameter -> value


def record_rig(effects: Sizes, unlisted: Sizes) -> Recording:
    """Return what an emulated rig shows, 40 s, its constants wrong as well."""
    rig = EmulatedRig(
        Concealed(effects, RIG, unlisted), encoders=Encoders(pole_counts=1024), timestep_s=1e-3
    )
    log = play_plan(rig, make_standard_plan(seconds=40.0, seed=3))
    every = np.ones(len(log.stamps_ns), dtype=bool)
    assert log.commands is not None
    signals = Signals(0.01, log.commands, log.positions[:, 0], log.positions[:, 1], every, every)
    return Recording("emulated", "sha256:0", signals)


@dataclass(frozen=True)
class Diagnosed:
    """Hold a case, the fit of constants alone, and the fit with names given to what is missing."""

    case: Case
    base: Fit
    named: Fit

    @cached_property
    def location(self) -> Localisation:
        twin = replace(self.case, twin=self.base.twin)
        runs = run_windows(twin, cut_windows(self.case.signals, self.case.state, WINDOW_S))
        return localise(inspect_twin(self.case, self.base.theta), self.base.theta, runs)

    @cached_property
    def doubted(self) -> set[str]:
        """Return the names whose shape is wrong; "all" where they explain too little."""
        names = tuple(n for n in self.named.effects if n not in self.base.effects)
        remainders = measure_remainders(self.case, self.named)
        misfits = find_wrong_shapes(self.case, self.named.theta, remainders, names)
        explained = 1.0 - (self.named.choose / self.base.choose) ** 2
        little = explained < decisions.LEAST_EXPLAINED_SHARE
        above_noise = self.named.choose > decisions.MISFIT_AT_NOISE
        everything = {"all"} if little and above_noise else set()
        return {misfit.effect for misfit in misfits} | everything


def diagnose_as(recording: Recording, names: Sizes) -> Diagnosed:
    """Return a recording fitted with parameters alone, and with effects, from these sizes on."""
    case = prepare_case([recording], INTECO)
    split = split_windows(case.signals, case.state)
    base = fit_parameters_alone(Search(case, split))
    theta = base.theta.copy()
    given = make_theta(Twin("named", INTECO.rig, names))
    neutral = make_theta(Twin("named", INTECO.rig, {}))
    theta[given != neutral] = given[given != neutral]
    return Diagnosed(case, base, fit(case, split, (*base.effects, *names), theta, base.pieces))


@dataclass(frozen=True)
class Unlisted:
    """Hold physics without a name, or physics whose name was not tried.

    sizes: by parameter.
    place: where it acts.
    variables: of which the evidence must hold one.
    nearest: the effect of the catalogue that comes nearest.
    """

    sizes: dict[str, float]
    place: str
    variables: set[str]
    nearest: dict[str, dict[str, float]]


UNLISTED = {
    "warming_friction": Unlisted(
        {"n_per_s": 0.02},
        "cart",
        {"cart_velocity*time"},
        {"cart_coulomb_friction": {"level_n": 0.4}},
    ),
    "half_rail_friction": Unlisted(
        {"level_n": 0.7, "from_m": 0.0},
        "cart",
        {"cart_velocity*cart_position"},
        {"cart_coulomb_friction": {"level_n": 0.3}},
    ),
    "drag_chain": Unlisted(
        {"n_per_m3": 20.0},
        "cart",
        {"cart_position"},
        {"rail_spring": {"n_per_m": 3.0, "centre_m": 0.01}},
    ),
    "hanging_cable": Unlisted(
        {"n_s_per_m2": 3.0},
        "cart",
        {"cart_velocity*cart_position"},
        {"cart_quadratic_drag": {"n_s2_m2": 0.2}},
    ),
    "periodic_force": Unlisted(
        {"amplitude_n": 0.5, "frequency_hz": 5.3, "phase_rad": 0.4},
        "cart",
        {"frequency"},
        {"rail_tilt": {"angle_rad": 0.001}},
    ),
    "gain_along_rail": Unlisted(
        {"per_m": 0.7}, "drive", {"command*cart_position"}, {"gain_asymmetry": {"ratio": 0.05}}
    ),
    "gain_falling_with_speed": Unlisted(
        {"s_per_m": 0.3},
        "drive",
        {"command*cart_velocity"},
        {"cart_quadratic_drag": {"n_s2_m2": 0.5}},
    ),
    "soft_saturation": Unlisted(
        {"limit": 0.45}, "command", {"command"}, {"input_saturation": {"limit": 0.35}}
    ),
    "bearing_notch": Unlisted(
        {"torque_n_m": 0.01, "phase_rad": 0.5},
        "pole",
        {"pole_angle"},
        {"pole_spring": {"n_m_per_rad": 0.001}},
    ),
    "stirred_air": Unlisted(
        {"n_s2": 0.0015},
        "pole",
        {"pole_rate*cart_velocity"},
        {"pole_quadratic_drag": {"n_m_s2": 2e-5}},
    ),
    "eccentric_encoder": Unlisted(
        {"sine_rad": 0.06, "cosine_rad": 0.035},
        "sensor",
        {"pole_angle"},
        {"angle_offset": {"angle_rad": 0.02}},
    ),
    "clock_wander": Unlisted(
        {"ratio": 0.08, "period_s": 12.0, "phase_rad": 0.0},
        "clock",
        {"time"},
        {"gain_drift": {"per_s": 0.001}},
    ),
}


@cache
def diagnose_unlisted(name: str) -> Diagnosed:
    sizes = {name: UNLISTED[name].sizes}
    recording = record_rig(sizes, {}) if name in BY_NAME else record_rig({}, sizes)
    return diagnose_as(recording, UNLISTED[name].nearest)


@pytest.mark.parametrize("name", UNLISTED)
def test_unlisted_physics_is_located_by_place_and_variable(name: str) -> None:
    location, expected = diagnose_unlisted(name).location, UNLISTED[name]
    assert location.place == expected.place
    shares = [(evidence.variable, evidence.share) for evidence in location.evidence]
    assert shares[0][0] in expected.variables, shares
    assert sum(share for variable, share in shares if variable in expected.variables) > 0.8


@pytest.mark.parametrize("name", UNLISTED)
def test_its_nearest_name_is_doubted(name: str) -> None:
    assert diagnose_unlisted(name).doubted & {*UNLISTED[name].nearest, "all"}


@pytest.mark.parametrize(
    "name",
    ["warming_friction", "half_rail_friction", "drag_chain", "soft_saturation", "stirred_air"],
)
def test_a_name_that_explains_most_of_it_is_doubted_by_its_shape(name: str) -> None:
    assert diagnose_unlisted(name).doubted >= set(UNLISTED[name].nearest)


def test_the_measured_shape_of_a_friction_that_grows_is_its_growth() -> None:
    curve = diagnose_unlisted("warming_friction").location.evidence[0]
    assert (curve.shape_of, curve.shape_unit, curve.shape_axis) == ("dry friction", "N", "time")
    inside = np.abs(curve.shape_y - 0.02 * curve.shape_x) <= curve.shape_band + 0.02
    assert np.mean(inside) > 0.8
    assert np.median(curve.shape_band) < 0.1


def test_the_measured_shape_of_an_eccentric_encoder_is_its_error() -> None:
    curve = diagnose_unlisted("eccentric_encoder").location.evidence[0]
    assert (curve.shape_of, curve.shape_unit, curve.shape_axis) == (
        "error of the angle",
        "rad",
        "pole_angle",
    )
    wave = curve.shape_y - curve.shape_y.mean()
    expected = 0.06 * np.sin(curve.shape_x) + 0.035 * np.cos(curve.shape_x)
    assert np.allclose(wave, expected, atol=0.01)


def test_a_vibration_is_measured() -> None:
    finding = diagnose_unlisted("periodic_force").location.evidence[0].finding
    assert "5.3 Hz" in finding
    assert float(finding.split("amplitude ")[1].split()[0]) == pytest.approx(0.5, rel=0.05)


LISTED: dict[str, Sizes] = {
    "nothing": {},
    "delay": {"input_delay": {"delay_s": 0.024}},
    "dead zone and offset": {
        "input_dead_zone": {"width": 0.035},
        "angle_offset": {"angle_rad": 0.05},
    },
    "friction, lag, drag": {
        "cart_coulomb_friction": {"level_n": 0.5},
        "motor_lag": {"time_constant_s": 0.03},
        "pole_quadratic_drag": {"n_m_s2": 3e-5},
    },
}


@pytest.mark.parametrize("name", LISTED)
def test_right_names_are_not_doubted_on_the_independent_engine(name: str) -> None:
    effects = LISTED[name]
    assert diagnose_as(record_rig(effects, {}), effects).doubted == set()


TWIN_MADE = {
    "rail_spring": {"n_per_m": 1.0, "centre_m": 0.1},
    "gain_drift": {"per_s": -0.003},
    "rail_tilt": {"angle_rad": 0.01},
    "cogging": {"amplitude_n": 0.3, "period_m": 0.12, "phase_rad": 1.0},
    "cart_stribeck_friction": {"level_n": 0.4, "static_n": 0.4, "velocity_m_s": 0.08},
    "pole_coulomb_friction": {"level_n_m": 0.001},
}


@pytest.mark.parametrize("name", TWIN_MADE)
def test_nor_are_they_on_the_twin_s_own_recordings(name: str) -> None:
    recording, _ = record_hidden({name: TWIN_MADE[name]}, seed=5, seconds=30.0)
    assert diagnose_as(recording, {name: TWIN_MADE[name]}).doubted == set()


def test_a_second_thing_that_is_missing_speaks_against_no_right_name() -> None:
    """Friction is named, a vibration is not: the friction stands, whatever remains."""
    friction = {"cart_coulomb_friction": {"level_n": 0.8}}
    vibration = {"amplitude_n": 0.4, "frequency_hz": 5.3, "phase_rad": 0.4}
    recording = record_rig({**friction, "periodic_force": vibration}, {})
    assert diagnose_as(recording, friction).doubted == set()
