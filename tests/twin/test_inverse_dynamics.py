"""The force and torque that a motion needs beyond its twin's are those of the effect left out."""

from dataclasses import replace

import numpy as np
import pytest
from support.twin_rigs import THESIS, recording, run

from pendulum_twin.free_runs import run_freely
from pendulum_twin.inverse_dynamics import compute_missing_force, evaluate_laws
from pendulum_twin.laws.law import Law
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import make_theta

PERIOD_S = 0.002
T = PERIOD_S * np.arange(1000)
COMMAND = 0.3 * np.sin(4.0 * T) + 0.1 * np.sin(11.0 * T)
START = (0.0, 2.5, 0.1, 0.0)
DRAG = {"cart_quadratic_drag": {"n_s2_m2": 3.0}, "pole_spring": {"n_m_per_rad": 0.01}}
RIPPLE = {"force_ripple": {"ratio": 0.2, "period_m": 0.3, "phase_rad": 0.5}}
PRESLIDING = {"cart_presliding_friction": {"level_n": 0.5, "distance_m": 0.02}}
LOAD = {"cart_load_friction": {"coefficient": 0.01}}  # too weak to hold the cart
INSIDE = slice(5, -5)  # where accelerations are central differences


def move(effects):
    """Return the recording of a twin with effects, its states (n, 4) and accelerations (n, 2)."""
    states = run(THESIS, COMMAND, effects, START, PERIOD_S)
    accelerations = np.gradient(states[:, 2:], PERIOD_S, axis=0)
    return recording(COMMAND, PERIOD_S), states, accelerations


WOBBLE = {"eccentric_encoder": {"sine_rad": 0.1, "cosine_rad": 0.1}}


@pytest.mark.parametrize(
    "effects", [{}, DRAG, WOBBLE, RIPPLE, PRESLIDING, LOAD], ids=lambda effects: "+".join(effects)
)
def test_a_twins_own_motion_lacks_nothing(effects):
    signals, states, accelerations = move(effects)
    theta = make_theta(Twin("test", THESIS, effects))
    lacking, usable = compute_missing_force(signals, states, accelerations, theta)
    # a thousandth of the drive's force and of the weight's torque
    assert np.max(np.abs(lacking[INSIDE][usable[INSIDE]]), axis=0) == pytest.approx(
        [0.0, 0.0], abs=4e-3
    )


def test_a_twin_whose_clock_wanders_lacks_nothing():
    law = Law((0.0, 0.5, 1.0, 1.5, 2.0), (0.0, 0.1, 0.0, -0.1, 0.0))
    theta = make_theta(Twin("test", THESIS, measured_laws={"clock_pace_over_time": law}))
    signals, first = recording(COMMAND, PERIOD_S), np.zeros(1, dtype=np.int64)
    (states,) = run_freely(signals, theta[None], first, first, np.array([START]), len(COMMAND))
    accelerations = np.gradient(states[:, 2:], PERIOD_S, axis=0)
    lacking, usable = compute_missing_force(signals, states, accelerations, theta)
    assert np.max(np.abs(lacking[INSIDE][usable[INSIDE]]), axis=0) == pytest.approx(
        [0.0, 0.0], abs=8e-3
    )
    even, _ = compute_missing_force(signals, states, accelerations, make_theta(Twin("t", THESIS)))
    assert np.max(np.abs(even[INSIDE]), axis=0)[0] > 0.1


def test_what_is_lacking_is_the_law_that_was_left_out():
    signals, states, accelerations = move(DRAG)
    base = make_theta(Twin("test", THESIS))
    lacking, usable = compute_missing_force(signals, states, accelerations, base)
    _, th, v, _ = states.T
    laws = np.stack([-3.0 * v * np.abs(v), -0.01 * (th - np.pi)], axis=1)
    chosen = np.flatnonzero(usable)[5:-5]
    np.testing.assert_allclose(lacking[chosen], laws[chosen], atol=4e-3)
    assert np.ptp(laws[:, 0]) > 0.5
    theta = make_theta(Twin("test", THESIS, DRAG))
    np.testing.assert_allclose(evaluate_laws(signals, states, theta), laws, atol=1e-12)


def test_samples_that_are_not_valid_or_of_a_standing_cart_do_not_count():
    signals, states, accelerations = move({})
    invalid = np.ones(len(signals), dtype=bool)
    invalid[100:200] = False
    signals = replace(signals, pole_valid=invalid)
    states[300:310, 2] = 0.0
    theta = make_theta(Twin("test", THESIS))
    _, usable = compute_missing_force(signals, states, accelerations, theta)
    assert not usable[100:200].any()
    assert not usable[300:310].any()
    assert usable.mean() > 0.7
