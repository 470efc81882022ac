"""Motions with an answer in closed form, and a solver that shares nothing with the kernel."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from support.twin_rigs import (
    CART_ALONE,
    FRICTIONLESS,
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

from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import COUPLING, INERTIA, MASS, MOMENT, make_theta

T = 0.01 * np.arange(500)
REST = np.zeros(500)


def choose_theta(rig):
    return make_theta(Twin("test", rig))


def test_small_swing_of_the_pole_alone():
    p = choose_theta(POLE_ALONE)
    rate = np.sqrt(p[MOMENT] * 9.81 / p[INERTIA])
    states = run(POLE_ALONE, REST, None, (0.0, np.pi + 1e-4, 0.0, 0.0))
    np.testing.assert_allclose(states[:, TH] - np.pi, 1e-4 * np.cos(rate * T), atol=1e-10)
    np.testing.assert_allclose(states[:, [X, V]], 0.0, atol=1e-15)


def test_small_swing_of_the_free_cart_and_pole():
    p = choose_theta(FRICTIONLESS)
    rate = np.sqrt(p[MOMENT] * 9.81 / (p[INERTIA] - p[COUPLING] ** 2 / p[MASS]))
    states = run(FRICTIONLESS, REST, None, (0.0, np.pi + 1e-4, 0.0, 0.0))
    swing = 1e-4 * np.cos(rate * T)
    np.testing.assert_allclose(states[:, TH] - np.pi, swing, atol=1e-10)
    np.testing.assert_allclose(states[:, X], -p[COUPLING] / p[MASS] * (swing - 1e-4), atol=1e-11)


def test_viscous_decay_of_the_cart_alone():
    rate = CART_ALONE.cart_viscous_n_s_m / CART_ALONE.cart_mass_kg
    states = run(CART_ALONE, REST, None, (0.1, np.pi, 0.8, 0.0))
    np.testing.assert_allclose(states[:, V], 0.8 * np.exp(-rate * T), rtol=1e-12)
    np.testing.assert_allclose(
        states[:, X], 0.1 + 0.8 / rate * (1 - np.exp(-rate * T)), rtol=1e-11
    )
    assert np.all(states[:, TH] == np.pi)


def test_viscous_decay_of_the_pole_alone():
    rig = type(POLE_ALONE)(
        **(POLE_ALONE.to_mapping() | {"gravity_m_s2": 0.0, "pole_viscous_n_m_s": 0.003})
    )
    states = run(rig, REST, None, (0.0, 0.0, 0.0, 5.0))
    np.testing.assert_allclose(
        states[:, W], 5.0 * np.exp(-0.003 / rig.pole_inertia_kg_m2 * T), rtol=1e-12
    )


def test_constant_force_on_the_cart_alone():
    states = run(SLIDING_CART, REST + 0.1)
    a = 0.1 * SLIDING_CART.force_per_pwm_n / SLIDING_CART.cart_mass_kg
    np.testing.assert_allclose(states[:, V], a * T, rtol=1e-12)
    np.testing.assert_allclose(states[:, X], a * T**2 / 2, rtol=1e-12, atol=1e-15)


def test_rest_stays_rest():
    # to the last bit of pi, which no float64 is
    np.testing.assert_allclose(run(THESIS, REST), np.tile(HANGING, (500, 1)), atol=1e-13)


@pytest.mark.parametrize("period_s", [0.001, 0.01, 0.0307])
def test_the_base_model_against_an_independent_solver(period_s):
    samples = round(3.0 / period_s)
    command = np.interp(period_s * np.arange(samples), 0.01 * np.arange(400), wild_command(400))
    m, distance, J, g = (
        THESIS.total_mass_kg,
        THESIS.com_distance_m,
        THESIS.pole_inertia_kg_m2,
        THESIS.gravity_m_s2,
    )
    fc, fp, S = THESIS.cart_viscous_n_s_m, THESIS.pole_viscous_n_m_s, m * distance

    def rates(t, state, force):
        _, th, v, w = state
        left = np.array([[m, -S * np.cos(th)], [-S * np.cos(th), J]])
        right = np.array([force - fc * v - S * w**2 * np.sin(th), S * g * np.sin(th) - fp * w])
        return np.concatenate([[v, w], np.linalg.solve(left, right)])

    state = np.array([0.0, 2.5, 0.1, 0.0])
    exact = [state]
    for u in command[:-1]:  # sample by sample, for the force jumps in between
        force = (THESIS.force_per_pwm_n * u,)
        state = solve_ivp(
            rates, (0, period_s), state, "DOP853", rtol=1e-10, atol=1e-12, args=force
        ).y[:, -1]
        exact.append(state)
    states = run(THESIS, command, None, tuple(exact[0]), period_s)
    np.testing.assert_allclose(states, np.array(exact), atol=2e-7)
