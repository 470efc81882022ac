"""The equations of motion and their elementary functions, against independent statements."""

import numba
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.twin_rigs import THESIS

from pendulum_twin.equations import (
    compute_cart_load,
    compute_energy,
    compute_pole_weight,
    exp,
    sin_cos,
    sin_cos_of_array,
    solve_accelerations,
)

M, S, J, G = (
    THESIS.total_mass_kg,
    THESIS.total_mass_kg * THESIS.com_distance_m,
    THESIS.pole_inertia_kg_m2,
    9.81,
)
numbers = st.floats(-20.0, 20.0)


def compute_by_kernel(th, w, force, torque, free=(1.0, 1.0)):
    sine, cosine = np.sin(th), np.cos(th)
    push = force + compute_cart_load.py_func(S, w, sine)
    turn = torque + compute_pole_weight.py_func(S, G, sine)
    return np.array(solve_accelerations.py_func(M, S * cosine, J, push, turn, *free))


@given(numbers, numbers, numbers, st.floats(-1.0, 1.0))
def test_accelerations_solve_the_two_coupled_equations(th, w, force, torque):
    # m v' - S cos(th) w' = force - S w^2 sin(th);  -S cos(th) v' + Jp w' = torque + S g sin(th)
    left = np.array([[M, -S * np.cos(th)], [-S * np.cos(th), J]])
    right = np.array([force - S * w**2 * np.sin(th), torque + S * G * np.sin(th)])
    np.testing.assert_allclose(
        compute_by_kernel(th, w, force, torque),
        np.linalg.solve(left, right),
        rtol=1e-10,
        atol=1e-10,
    )


@given(numbers, numbers, numbers, st.floats(-1.0, 1.0))
def test_a_joint_that_sticks_leaves_the_other_its_own_equation(th, w, force, torque):
    cart_stuck = compute_by_kernel(th, w, force, torque, (0.0, 1.0))
    pole_stuck = compute_by_kernel(th, w, force, torque, (1.0, 0.0))
    np.testing.assert_allclose(
        cart_stuck, [0.0, (torque + S * G * np.sin(th)) / J], rtol=1e-10, atol=1e-10
    )
    np.testing.assert_allclose(
        pole_stuck, [(force - S * w**2 * np.sin(th)) / M, 0.0], rtol=1e-10, atol=1e-10
    )


@given(numbers, st.floats(-2.0, 2.0), numbers)
def test_energy_changes_by_nothing_but_work(th, v, w):
    force, torque = 0.7, -0.03
    rate, h = compute_by_kernel(th, w, force, torque), 1e-6
    before, after = (
        compute_energy(
            M, S, S, J, G, np.array([0.0, th + s * w, v + s * rate[0], w + s * rate[1]])
        )
        for s in (-h, h)
    )
    assert (after - before) / (2 * h) == pytest.approx(force * v + torque * w, rel=1e-6, abs=2e-6)


def test_upright_is_an_unstable_rest_and_hanging_a_stable_one():
    assert compute_by_kernel(0.01, 0.0, 0.0, 0.0)[1] > 0
    assert compute_by_kernel(np.pi + 0.01, 0.0, 0.0, 0.0)[1] < 0


@numba.njit
def along(numbers, out):
    for n in range(len(numbers)):
        out[n, 0], out[n, 1] = sin_cos(numbers[n])
        out[n, 2] = exp(numbers[n])


def values(numbers):
    out = np.empty((len(numbers), 3))
    along(numbers, out)
    return out.T


@pytest.mark.parametrize("reach", [0.8, 10.0, 1e3, 1e5])
def test_sine_and_cosine_to_the_last_bits(reach):
    angles = np.random.default_rng(1).uniform(-reach, reach, 200_000)
    exact = angles.astype(np.longdouble)
    sine, cosine, _ = values(angles)
    assert np.max(np.abs(sine - np.sin(exact))) < 3e-16
    assert np.max(np.abs(cosine - np.cos(exact))) < 3e-16


def test_sine_and_cosine_at_whole_quarters():
    sine, cosine, _ = values(np.pi / 2 * np.arange(-8, 9))
    np.testing.assert_allclose(sine, np.sin(np.pi / 2 * np.arange(-8, 9)), atol=1e-15)
    np.testing.assert_allclose(cosine, np.cos(np.pi / 2 * np.arange(-8, 9)), atol=1e-15)


@pytest.mark.parametrize("reach", [1e-3, 1.0, 30.0, 700.0])
def test_exponential_to_the_last_bits(reach):
    powers = np.random.default_rng(2).uniform(-reach, reach, 200_000)
    assert np.max(np.abs(values(powers)[2] / np.exp(powers.astype(np.longdouble)) - 1)) < 4e-16


def test_exponential_of_zero_is_one_and_beyond_its_range_stays_finite():
    _, _, (unit, small, large) = values(np.array([0.0, -1e12, 1e12]))
    assert unit == 1.0
    assert 0.0 < small < 1e-300
    assert 1e300 < large < np.inf


def test_sine_and_cosine_of_arrays_and_of_compiled_numbers_are_the_same_bits():
    angles = np.random.default_rng(3).uniform(-1e5, 1e5, 20_000)

    @numba.njit
    def compute_singly(numbers, out):
        for n in range(len(numbers)):
            out[n, 0], out[n, 1] = sin_cos_of_array(numbers[n])

    singly = np.empty((len(angles), 2))
    compute_singly(angles, singly)
    sine, cosine = sin_cos_of_array.py_func(angles)
    assert np.array_equal(np.stack([sine, cosine], axis=1), singly)
    assert np.max(np.abs(sine - np.sin(angles.astype(np.longdouble)))) < 3e-16
    assert np.max(np.abs(cosine - np.cos(angles.astype(np.longdouble)))) < 3e-16
