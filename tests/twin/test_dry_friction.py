"""Dry friction: block and pole against closed forms, exact rest, and when sticking ends."""

import numpy as np
import pytest
from support.twin_rigs import (
    HANGING,
    POLE_ALONE,
    SLIDING_CART,
    TH,
    THESIS,
    V,
    W,
    X,
    run,
    wild_command,
)

from pendulum_twin import kernel
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import INERTIA, MOMENT, make_theta

MASS, GAIN = SLIDING_CART.cart_mass_kg, SLIDING_CART.force_per_pwm_n
COULOMB = {"cart_coulomb_friction": {"level_n": 0.6}}
T = 0.01 * np.arange(300)


@pytest.mark.parametrize("way", [1, -1])
def test_block_under_a_constant_force(way):
    states = run(SLIDING_CART, np.full(300, 0.1 * way), COULOMB)
    np.testing.assert_allclose(states[:, V], way * (0.1 * GAIN - 0.6) / MASS * T, rtol=1e-11)


@pytest.mark.parametrize("way", [1, -1])
def test_block_comes_to_rest_and_stays(way):
    states = run(SLIDING_CART, np.zeros(300), COULOMB, (0.0, np.pi, way * 0.777, 0.0))
    stops = 0.777 * MASS / 0.6
    assert np.all(way * states[stops > T, V] > 0)
    assert np.all(states[stops < T, V] == 0.0)
    assert np.all(states[stops < T, X] == states[-1, X])
    assert way * states[-1, X] == pytest.approx(MASS * 0.777**2 / (2 * 0.6), rel=1e-9)


def test_sticks_up_to_its_level_and_breaks_away_above():
    force = np.repeat([0.3, 0.599999, 0.600001, 0.0, -0.599999, -0.600001], 50)
    still = run(SLIDING_CART, force[:101] / GAIN, COULOMB)
    assert np.all(still[:101, V] == 0.0)
    assert run(SLIDING_CART, force[:103] / GAIN, COULOMB)[102, V] > 0.0
    assert run(SLIDING_CART, -force[:103] / GAIN, COULOMB)[102, V] < 0.0


def test_stribeck_breaks_away_at_level_and_static_together():
    effects = {"cart_stribeck_friction": {"level_n": 0.4, "static_n": 0.3, "velocity_m_s": 0.01}}
    assert np.all(run(SLIDING_CART, np.full(300, 0.699 / GAIN), effects)[:, V] == 0.0)
    states = run(SLIDING_CART, np.full(300, 0.701 / GAIN), effects)
    # once it slides, the static part is gone
    assert (states[-1, V] - states[-2, V]) / 0.01 == pytest.approx((0.701 - 0.4) / MASS, rel=1e-6)


def test_lopsided_friction_breaks_away_at_two_levels():
    effects = COULOMB | {
        "cart_friction_asymmetry": {"ratio": 0.5}
    }  # 0.9 N forwards, 0.3 N backwards
    assert np.all(run(SLIDING_CART, np.full(50, 0.89 / GAIN), effects)[:, V] == 0.0)
    assert run(SLIDING_CART, np.full(50, 0.91 / GAIN), effects)[-1, V] > 0.0
    assert run(SLIDING_CART, np.full(50, -0.31 / GAIN), effects)[-1, V] < 0.0


def test_dry_friction_takes_the_same_from_every_swing():
    p = make_theta(Twin("test", POLE_ALONE))
    loss = 0.002  # rad a half swing: twice the level over the stiffness
    level = loss / 2 * p[MOMENT] * 9.81
    effects = {"pole_coulomb_friction": {"level_n_m": level}}
    states = run(POLE_ALONE, np.zeros(20_000), effects, (0.0, np.pi + 0.02, 0.0, 0.0), 0.001)
    swing, rate = states[:, TH] - np.pi, states[:, W]
    turns = np.flatnonzero((rate[1:-1] * rate[2:] <= 0) & (rate[1:-1] != 0)) + 1
    heights = np.abs(np.concatenate([[0.02], swing[turns]]))
    np.testing.assert_allclose(-np.diff(heights), loss, rtol=2e-3)
    period = 2 * np.pi / np.sqrt(p[MOMENT] * 9.81 / p[INERTIA])
    np.testing.assert_allclose(np.diff(turns) * 0.001, period / 2, atol=0.0015)
    assert states[-1, W] == 0.0
    assert np.abs(swing[-1]) <= loss / 2


def test_a_stuck_cart_is_dragged_along_by_a_swinging_pole_only_above_its_level():
    swinging = (0.0, np.pi + 1.5, 0.0, 0.0)
    states = run(THESIS, np.zeros(300), {"cart_coulomb_friction": {"level_n": 5.0}}, swinging)
    assert np.all(states[:, [X, V]] == 0.0)
    assert np.ptp(states[:, TH]) > 2.0
    dragged = run(THESIS, np.zeros(300), {"cart_coulomb_friction": {"level_n": 0.2}}, swinging)
    assert np.ptp(dragged[:, X]) > 1e-4


def test_a_held_cart_leaves_the_pole_the_motion_of_a_pole_alone():
    states = run(
        THESIS, np.zeros(300), {"cart_coulomb_friction": {"level_n": 50.0}}, (0.0, 2.0, 0.0, 0.0)
    )
    alone = type(THESIS)(
        pole_mass_kg=THESIS.total_mass_kg,  # the same moment: mass times distance
        com_distance_m=THESIS.com_distance_m,
        pole_inertia_kg_m2=THESIS.pole_inertia_kg_m2,
        pole_viscous_n_m_s=THESIS.pole_viscous_n_m_s,
    )
    np.testing.assert_allclose(
        states[:, TH], run(alone, np.zeros(300), None, (0.0, 2.0, 0.0, 0.0))[:, TH], atol=1e-12
    )


FRICTIONS = {
    "coulomb": {"cart_coulomb_friction": {"level_n": 1.2}},
    "stribeck": {
        "cart_stribeck_friction": {"level_n": 0.8, "static_n": 0.4, "velocity_m_s": 0.05}
    },
    "both joints": {
        "cart_coulomb_friction": {"level_n": 1.2},
        "pole_coulomb_friction": {"level_n_m": 0.004},
    },
}


@pytest.mark.parametrize("name", FRICTIONS)
def test_halving_the_step_changes_nothing_that_could_be_measured(name, monkeypatch):
    command, start = wild_command(500), (0.0, 2.5, 0.2, 0.0)
    whole = run(THESIS, command, FRICTIONS[name], start)
    monkeypatch.setattr(kernel, "LONGEST_STEP_S", 0.5e-3)
    half = run(THESIS, command, FRICTIONS[name], start)
    assert np.mean(whole[:, V] == 0.0) > 0.02, "the run should stick now and then"
    assert np.max(np.abs(half - whole)[:, [X, TH]]) < 1e-6


def test_the_error_falls_with_the_fourth_power_of_the_step(monkeypatch):
    runs = []
    for step_s in (4e-3, 2e-3, 1.25e-4):
        monkeypatch.setattr(kernel, "LONGEST_STEP_S", step_s)
        runs.append(run(THESIS, wild_command(300), None, (0.0, 2.5, 0.2, 0.0), 0.02))
    coarse, fine = (np.max(np.abs(states - runs[-1])) for states in runs[:-1])
    assert 12 < coarse / fine < 20


def test_breaking_away_inside_a_step_is_found():
    # A spring too weak to hold on to: the pole's pull grows smoothly and frees the cart between
    # two steps.
    effects = {"cart_coulomb_friction": {"level_n": 0.4}}
    states = run(THESIS, np.zeros(200), effects, (0.0, np.pi + 2.0, 0.0, 0.0), 0.001)
    fine = run(THESIS, np.zeros(2000), effects, (0.0, np.pi + 2.0, 0.0, 0.0), 0.0001)[::10]
    assert np.any(states[:, V] == 0.0)
    assert np.any(states[:, V] != 0.0)
    assert np.max(np.abs(states - fine)) < 1e-8


def test_hanging_at_rest_stays_exactly_there():
    states = run(THESIS, np.zeros(100), FRICTIONS["both joints"], HANGING)
    assert np.all(states == np.array(HANGING))
