"""Where a mismatch lives, without the catalogue: place, variable and measured shape."""

import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from support.hidden_physics import HIDDEN, INTECO, record_hidden

from pendulum_sysid.finding.journal import Search
from pendulum_sysid.finding.localisation.balance import make_balances
from pendulum_sysid.finding.localisation.inspection import inspect_twin, inspect_twins
from pendulum_sysid.finding.localisation.knots import make_hats, make_sided_knots, spread_knots
from pendulum_sysid.finding.localisation.localise import (
    AXIS_UNITS,
    find_worst_stretches,
    localise,
)
from pendulum_sysid.finding.localisation.measured_curves import compute_typical_slope
from pendulum_sysid.finding.localisation.thinning import thin_out
from pendulum_sysid.finding.signs import fit_parameters_alone
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.split import split_windows
from pendulum_sysid.fitting.window_runs import WindowRuns, run_windows
from pendulum_sysid.fitting.windows import WINDOW_S, cut_windows
from pendulum_sysid.prepare import prepare_case
from pendulum_sysid.records import Evidence, Localisation, Recording
from pendulum_sysid.telling.wording import VARIABLES
from pendulum_twin.arrays import Floats
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import make_theta


def localise_twin(case: Case, twin: Twin, theta: Floats) -> Localisation:
    windows = cut_windows(case.signals, case.state, WINDOW_S)
    return localise(
        inspect_twin(case, theta), theta, run_windows(replace(case, twin=twin), windows)
    )


def localise_refitted(recording: Recording) -> Localisation:
    """Return where a twin with its constants refitted falls short, as a diagnosis does."""
    case = prepare_case([recording], INTECO)
    base = fit_parameters_alone(Search(case, split_windows(case.signals, case.state)))
    return localise_twin(case, base.twin, base.theta)


@cache
def _localise_hidden(names: tuple[str, ...], known_constants: bool) -> Localisation:
    recording, truth = record_hidden({name: HIDDEN[name] for name in names}, 1, 20.0)
    if not known_constants:
        return localise_refitted(recording)
    case = prepare_case([recording], replace(truth, effects={}))
    return localise_twin(case, case.twin, make_theta(case.twin))


def localise_hidden(*names: str, known_constants: bool = False) -> Localisation:
    """Return where a twin without the effects falls short.

    known_constants: the twin has the true constants; else they are refitted.
    """
    return _localise_hidden(names, known_constants)


LATE = {"command_rate", "command_history"}
OF_ONE_EFFECT = {
    "cart_coulomb_friction": ({"cart_velocity"}, "cart"),
    "cart_quadratic_drag": ({"cart_velocity"}, "cart"),
    "rail_spring": ({"cart_position"}, "cart"),
    "rail_tilt": ({"constant"}, "cart"),
    "input_delay": (LATE, "drive"),
    "motor_lag": (LATE, "drive"),
    "input_dead_zone": ({"command"}, "command"),
    "gain_asymmetry": ({"command"}, "command"),
    "pole_coulomb_friction": ({"pole_rate"}, "pole"),
    "pole_spring": ({"pole_angle"}, "pole"),
    "angle_offset": ({"pole_angle"}, "sensor"),
}


@pytest.mark.parametrize("name", OF_ONE_EFFECT)
def test_the_missing_force_depends_on_its_own_variable(name: str) -> None:
    """Also when fitting constants has hidden a part of it, which they have to give back."""
    variables, place = OF_ONE_EFFECT[name]
    location = localise_hidden(name)
    assert location.place == place
    assert location.evidence[0].variable in variables, location.evidence
    assert location.evidence[0].share > 0.5
    assert "% of what is missing goes with it, in the " in location.evidence[0].finding


def test_a_curve_over_a_speed_says_its_units() -> None:
    finding = localise_hidden("cart_coulomb_friction").evidence[0].finding
    assert re.search(r" N at \S+ m/s to \S+ N at \S+ m/s$", finding), finding
    for axis, unit in AXIS_UNITS.items():
        assert VARIABLES[axis][1] == unit


@pytest.mark.parametrize(
    "name", ["cart_coulomb_friction", "pole_quadratic_drag", "input_dead_zone"]
)
def test_it_does_so_with_known_constants(name: str) -> None:
    location = localise_hidden(name, known_constants=True)
    assert (
        location.evidence[0].variable in {"cart_velocity", "pole_rate", "command"}
        and location.evidence[0].share > 0.5
    )


def assert_a_step_of_friction(curve: Evidence) -> None:
    moving = np.abs(curve.shape_x) > 0.1
    truth = -0.5 * np.sign(curve.shape_x[moving])
    assert np.allclose(curve.shape_y[moving], truth, atol=0.05)
    assert np.mean(np.abs(curve.shape_y[moving] - truth) <= curve.shape_band[moving] + 0.02) >= 0.8
    assert len(curve.shape_x) == len(curve.shape_y) == len(curve.shape_band) and np.all(
        curve.shape_band >= 0
    )


@pytest.mark.parametrize("known_constants", [True, False])
def test_the_measured_shape_is_the_effect_s_and_not_what_fitting_left_of_it(
    known_constants: bool,
) -> None:
    """Coulomb friction is a step at zero speed; viscous friction alone takes most of it."""
    assert_a_step_of_friction(
        localise_hidden("cart_coulomb_friction", known_constants=known_constants).evidence[0]
    )


def get_number(evidence: Evidence, text: str) -> float:
    """Return the number that follows some text in a finding."""
    return float(evidence.finding.split(text)[1].split()[0])


def test_a_late_force_is_measured_by_how_late_it_is() -> None:
    """A delay of 23 ms is told so; of a lag of 40 ms half has come after ln 2 times as much."""
    assert get_number(localise_hidden("input_delay").evidence[0], "comes late") == pytest.approx(
        0.023, abs=0.002
    )
    lag = localise_hidden("motor_lag").evidence[0]
    assert lag.shape_axis == "lag" and lag.shape_unit == "N"
    assert get_number(lag, "has come") == pytest.approx(0.04 * np.log(2.0), abs=0.005)


def test_an_angle_s_error_is_measured() -> None:
    assert get_number(
        localise_hidden("angle_offset").evidence[0], "error of the angle"
    ) == pytest.approx(0.03, rel=0.02)


def test_a_pole_that_is_seen_later_than_the_cart_is_a_shift_in_time() -> None:
    recording, _ = record_hidden({}, 1, 20.0)
    signals = recording.signals
    t = np.arange(len(signals)) * signals.period_s
    assert signals.pole is not None
    late = replace(recording, signals=replace(signals, pole=np.interp(t - 0.008, t, signals.pole)))
    location = localise_refitted(late)
    assert location.place == "sensor"
    shifts = [evidence for evidence in location.evidence if evidence.variable == "time_shift"]
    assert sum(evidence.share for evidence in shifts) > 0.8
    for evidence in shifts:  # both equations at once, and the same
        assert get_number(evidence, "is late") == pytest.approx(0.008, abs=0.001)


def test_noise_has_no_share() -> None:
    recording, _ = record_hidden({}, 2, 20.0)
    assert localise_refitted(recording).evidence == ()


PAIR = ("gain_asymmetry", "angle_offset")


@pytest.mark.parametrize("names", [("input_delay",), ("angle_offset",), PAIR], ids="+".join)
def test_shares_of_force_and_torque_add_up_to_one_at_most(names: tuple[str, ...]) -> None:
    shares = [evidence.share for evidence in localise_hidden(*names).evidence]
    assert 0.8 < sum(shares) <= 1.0 + 1e-9 and shares == sorted(shares, reverse=True)


def test_both_equations_are_heard() -> None:
    assert {"command", "pole_angle"} <= {
        evidence.variable for evidence in localise_hidden(*PAIR).evidence
    }


def test_stretches_are_those_where_runs_are_far_off() -> None:
    error = np.ones(10)
    error[[3, 4, 8]] = 5.0
    measured = error[:, None, None] * np.ones((10, 101, 1))
    runs = WindowRuns(
        (0,),
        np.arange(10.0),
        0.01,
        measured,
        np.zeros_like(measured),
        np.ones_like(measured),
        np.ones(1),
    )
    assert find_worst_stretches(runs) == ((3.0, 5.0), (8.0, 9.0))


def test_a_long_recording_is_asked_by_pieces_at_their_own_times() -> None:
    recording, truth = record_hidden({"rail_spring": HIDDEN["rail_spring"]}, 1, 120.0)
    case = prepare_case([recording], replace(truth, effects={}))
    fewer = thin_out(case, most=6000)
    signals = fewer.signals
    assert len(signals) == 6000 and len(signals.stretches) == len(signals.stretch_begins)
    at = np.round(signals.times_s / signals.period_s).astype(int)
    assert (
        np.array_equal(signals.command, case.signals.command[at])
        and np.ptp(signals.times_s) > 70.0
    )
    assert np.array_equal(fewer.state.states, case.state.states[at])
    assert thin_out(case) is case


def test_hats_are_the_weights_of_interpolation() -> None:
    random = np.random.default_rng(1)
    x = random.uniform(-2, 2, 500)
    knots = spread_knots(x, 9)
    assert np.allclose(
        make_hats(x, knots) @ knots**2, np.interp(x, knots, knots**2)
    ) and np.allclose(make_hats(x, knots).sum(axis=1), 1)


def test_a_curve_over_a_signed_variable_may_jump_at_zero() -> None:
    x = np.linspace(-1, 1, 1001)
    knots, weights = make_sided_knots(x)
    assert np.count_nonzero(knots == 0) == 2
    assert np.allclose(
        (weights @ np.where(np.arange(len(knots)) < len(knots) // 2, -1.0, 1.0))[x != 0],
        np.sign(x)[x != 0],
    )


def test_dry_friction_s_typical_slope_is_the_viscous_part() -> None:
    x = np.array([-1.0, -0.5, -0.1, 0.0, 0.0, 0.1, 0.5, 1.0])
    step = np.array([0.4] * 4 + [-0.4] * 4)
    assert compute_typical_slope(x, step - 0.7 * x) == pytest.approx(-0.7)


def test_both_sides_of_a_balance_go_through_the_same_filter() -> None:
    """A jump of the force leaves nothing behind where the acceleration is smoothed."""
    recording, truth = record_hidden({}, 3, 20.0)
    case = prepare_case([recording], truth)
    for balance in make_balances(case, make_theta(truth)):
        residual = balance.lacking
        assert np.sqrt(np.mean(residual**2)) < 2.0 * balance.noise < 0.1 * balance.size


def test_equal_twins_are_inspected_once() -> None:
    case = prepare_case([record_hidden({}, 1, 20.0)[0]], INTECO)
    theta = make_theta(INTECO)
    other = theta.copy()
    other[0] *= 1.01
    first, again, different = inspect_twins(case, (theta, theta.copy(), other))
    assert first is again
    assert first is not different
