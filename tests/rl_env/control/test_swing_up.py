"""The swing-up: the energy is the twin's own; the cart makes it grow within the limits."""

import math
from dataclasses import replace

import numpy as np
import pytest

from pendulum_rl_env.control.swing_up import SwingUp, compute_acceleration, compute_energy
from pendulum_rl_env.task import Task
from pendulum_twin.model import Twin, load_twin
from pendulum_twin.parameter_vector import make_theta
from pendulum_twin.stepper import Stepper

RIG = load_twin("config/inteco.yaml").rig
THETA = make_theta(Twin("made", RIG))
STRONG = 9.0
TASK = Task()


def push(x: float, th: float, v: float, w: float, how: SwingUp = SwingUp()) -> float:  # noqa: B008
    return compute_acceleration(np.array([x, th, v, w]), THETA, STRONG, how, TASK)


def test_energy_is_minus_one_hanging_and_nothing_upright() -> None:
    assert compute_energy(np.array([0.3, math.pi, 1.0, 0.0]), THETA) == -1.0
    assert compute_energy(np.array([0.3, 2 * math.pi, 1.0, 0.0]), THETA) == pytest.approx(0.0)


@pytest.mark.parametrize("effects", [{}, {"pole_spring": {"n_m_per_rad": 0.006}}])
def test_energy_is_kept_by_a_pole_that_swings_freely_on_a_cart_that_is_held(
    effects: dict[str, dict[str, float]],
) -> None:
    heavy = Twin(
        "held",
        replace(RIG, cart_mass_kg=1e6, com_distance_m=0.0135 / 1e6, pole_viscous_n_m_s=0.0),
        effects,
    )
    stepper, theta = Stepper(heavy, 0.01, (0.0, 0.4, 0.0, 1.0)), make_theta(heavy)
    energies = [compute_energy(stepper.step(0.0), theta, -0.1) for _ in range(100)]
    assert np.ptp(energies) < 1e-6 and energies[0] != pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize(
    ("th", "w"), [(2.6, 3.0), (2.6, -3.0), (1.0, 2.0), (5.0, -2.0), (4.0, 3.0)]
)
def test_the_cart_is_pushed_so_that_energy_grows_and_the_other_way_when_there_is_too_much(
    th: float, w: float
) -> None:
    assert push(0.0, th, 0.0, w) * math.cos(th) * w > 0.5
    fast = math.copysign(20.0, w)
    assert push(0.0, th, 0.0, fast) * math.cos(th) * fast < -0.5


def test_a_pole_at_rest_is_pushed_the_way_that_is_asked_for() -> None:
    assert push(0.0, math.pi, 0.0, 0.0, SwingUp(first=-1.0)) == -STRONG
    assert push(0.0, math.pi, 0.0, 0.0, SwingUp(first=1.0)) == STRONG


def test_the_cart_is_kept_within_the_limits() -> None:
    assert push(0.5, 2.6, 1.5, -3.0) == -STRONG  # it would not stop in time
    assert push(-0.5, 2.6, -1.5, 3.0) == STRONG
    assert push(-0.2, 2.6, 2.7, -3.0) <= 0.0  # fast enough
    assert abs(push(0.1, 2.6, 0.0, -3.0)) <= STRONG
