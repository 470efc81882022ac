"""Where a mismatch lives, asked without the catalogue: the variable that the missing force depends on."""

from dataclasses import replace

import numpy as np
import pytest
from hidden_physics import HIDDEN, INTECO, hidden

from pendulum_sysid.case import case_of
from pendulum_sysid.localise import averaged, localise, stretches
from pendulum_sysid.records import Localisation
from pendulum_sysid.search import Search, parameters_alone
from pendulum_sysid.split import split
from pendulum_sysid.window_runs import WindowRuns, run_windows
from pendulum_sysid.windows import WINDOW_S, cut
from pendulum_twin.words import words_of


def located(effects: dict, seed: int = 1, known_constants: bool = False) -> Localisation:
    """Return where a twin without the effects falls short: its constants refitted as a diagnosis does, or the true ones."""
    recording, truth = hidden(effects, seed, 20.0)
    case = case_of(recording, replace(truth, effects={}) if known_constants else INTECO)
    base = parameters_alone(Search(case, split(case.signals, case.state), lambda line: None))
    twin, words = (case.twin, words_of(case.twin)) if known_constants else (base.twin, base.words)
    return localise(case, words, run_windows(replace(case, twin=twin), cut(case.signals, case.state, WINDOW_S)))


OF_THE_CART = {
    "cart_coulomb_friction": ({"level_n": 0.5}, {"cart_velocity"}, "cart"),
    "rail_spring": ({"n_per_m": 2.0, "centre_m": 0.1}, {"cart_position"}, "cart"),
    "input_delay": ({"delay_s": 0.023}, {"command", "command_rate"}, "drive"),
    "motor_lag": ({"time_constant_s": 0.04}, {"command", "command_rate"}, "drive"),
    "input_dead_zone": ({"width": 0.04}, {"command"}, "command"),
}
OF_THE_POLE = {
    "pole_coulomb_friction": ({"level_n_m": 0.004}, {"pole_rate"}, "pole"),
    "pole_quadratic_drag": ({"n_m_s2": 2e-4}, {"pole_rate"}, "pole"),
}


def assert_found(name: str, sizes: dict, variables: set[str], place: str, known_constants: bool) -> None:
    found = located({name: sizes}, known_constants=known_constants)
    assert found.evidence[0].variable in variables, [(one.variable, one.share) for one in found.evidence]
    assert found.evidence[0].share > 0.25 and found.place == place


@pytest.mark.parametrize("name", OF_THE_CART | OF_THE_POLE)
def test_the_missing_force_depends_most_on_its_own_variable(name: str) -> None:
    assert_found(name, *(OF_THE_CART | OF_THE_POLE)[name], known_constants=True)


@pytest.mark.parametrize("name", OF_THE_CART)
def test_it_does_when_the_constants_have_been_refitted_too(name: str) -> None:
    assert_found(name, *OF_THE_CART[name], known_constants=False)


@pytest.mark.parametrize("name", OF_THE_POLE)
def test_so_does_the_missing_torque(name: str) -> None:
    assert_found(name, *OF_THE_POLE[name], known_constants=False)


def test_the_shape_of_the_missing_force_is_measured() -> None:
    """Coulomb friction is a step of twice its level at zero speed."""
    curve = located({"cart_coulomb_friction": {"level_n": 0.5}}, known_constants=True).evidence[0]
    moving = np.abs(curve.shape_x) > 0.1
    assert np.allclose(curve.shape_y[moving], -0.5 * np.sign(curve.shape_x[moving]), atol=0.1)
    assert len(curve.shape_x) == len(curve.shape_y) == len(curve.shape_band) and np.all(curve.shape_band >= 0)


@pytest.mark.parametrize("name", ["cart_coulomb_friction", "rail_spring", "input_delay", "input_dead_zone", "angle_offset"])
def test_shares_add_up_to_one_at_most(name: str) -> None:
    shares = [one.share for one in located({name: HIDDEN[name]}).evidence]
    assert 0.0 < sum(shares) <= 1.0 and shares == sorted(shares, reverse=True)


def test_shares_of_the_missing_force_add_up_to_one_at_most() -> None:
    effects = {"cart_coulomb_friction": {"level_n": 1.0}, "rail_spring": {"n_per_m": 2.0, "centre_m": 0.1}}
    force = [one for one in located(effects).evidence if "force" in one.finding]
    assert 0.5 < sum(one.share for one in force) <= 1.0


def test_a_constant_push_on_the_cart_is_not_the_pole_s() -> None:
    assert located({"rail_tilt": {"angle_rad": 0.02}}, known_constants=True).place == "cart"


def test_stretches_are_those_where_runs_are_far_off() -> None:
    error = np.ones(10)
    error[[3, 4, 8]] = 5.0
    measured = error[:, None, None] * np.ones((10, 101, 1))
    runs = WindowRuns((0,), np.arange(10.0), 0.01, measured, np.zeros_like(measured), np.ones_like(measured), np.ones(1))
    assert stretches(runs) == ((3.0, 5.0), (8.0, 9.0))


def test_averages_hold_the_truth_in_their_intervals() -> None:
    random = np.random.default_rng(1)
    x = random.uniform(-1, 1, 20_000)
    curve = averaged(x, np.where(x > 0, -1.0, 1.0) + random.normal(0, 0.5, len(x)))
    inside = np.abs(curve.y + np.sign(curve.x)) <= curve.band
    assert np.mean(inside[np.abs(curve.x) > 0.1]) >= 0.85
    assert np.all(np.diff(curve.x) > 0)


def test_a_variable_that_never_moves_explains_nothing() -> None:
    curve = averaged(np.zeros(1000), np.random.default_rng(2).normal(size=1000))
    assert len(curve.x) == 1 and abs(curve.y[0]) < 0.1
