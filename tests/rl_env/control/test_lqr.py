"""The regulator: the linear map is the equations', and the closed loop is stable."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm

from pendulum_rl_env.control.lqr import design_regulator, find_upright, linearise
from pendulum_twin.errors import BadInputError
from pendulum_twin.laws.law import Law, spread_turn
from pendulum_twin.model import Twin, load_twin

STEP_S = 0.03
RIG = load_twin("config/inteco.yaml").rig
WEIGHTS = (10.0, 10.0, 0.5, 0.1, 1e-3)


def make_twin(**effects: dict[str, float]) -> Twin:
    return Twin("made", RIG, effects)


def make_map(**effects: dict[str, float]):
    return linearise(make_twin(**effects), find_upright(make_twin(**effects)), STEP_S)


def test_the_map_is_that_of_the_equations_upright() -> None:
    m, moment, inertia = (
        RIG.total_mass_kg,
        RIG.total_mass_kg * RIG.com_distance_m,
        RIG.pole_inertia_kg_m2,
    )
    coupled = np.linalg.inv([[m, -moment], [-moment, inertia]])
    both = np.zeros((5, 5))
    both[0, 2] = both[1, 3] = 1.0
    both[2:4, :4] = coupled @ [
        [0, 0, -RIG.cart_viscous_n_s_m, 0],
        [0, moment * 9.81, 0, -RIG.pole_viscous_n_m_s],
    ]
    both[2:4, 4] = coupled @ [RIG.force_per_pwm_n, 0]
    exact, linear = expm(both * STEP_S), make_map()
    assert linear.state == pytest.approx(exact[:4, :4], abs=1e-6)
    assert linear.drive == pytest.approx(exact[None, :4, 4], abs=1e-6)


def test_a_delay_of_a_period_moves_the_drive_by_one_and_a_part_of_it_by_a_part() -> None:
    now, later, half = (
        make_map(),
        make_map(input_delay={"delay_s": STEP_S}),
        make_map(sensor_delay={"delay_s": STEP_S / 2}),
    )
    assert later.drive == pytest.approx(np.vstack([np.zeros(4), now.drive]), abs=1e-9)
    assert (
        half.drive[:, 2].sum() == pytest.approx(now.drive[0, 2], rel=0.02)
        and min(half.drive[:, 2]) > 0.25
    )


def test_a_lag_spreads_the_drive_over_the_periods_after() -> None:
    spread = make_map(motor_lag={"time_constant_s": 0.05}).drive
    assert spread[2:, 2] == pytest.approx(spread[1:-1, 2] * math.exp(-STEP_S / 0.05), rel=1e-4)


def test_dry_friction_is_not_in_the_map() -> None:
    assert np.array_equal(make_map(cart_coulomb_friction={"level_n": 1.0}).state, make_map().state)


def test_a_tilt_takes_a_drive_and_a_spring_leans_the_pole_the_same_way_from_either_side() -> None:
    assert find_upright(make_twin(rail_tilt={"angle_rad": 0.02})).drive == pytest.approx(
        -RIG.total_mass_kg * 9.81 * 0.02 / 12.86
    )
    lean, other_lean = (
        find_upright(make_twin(pole_spring={"n_m_per_rad": 0.005}), turn).angle_rad
        for turn in (0, 1)
    )
    weight = RIG.total_mass_kg * RIG.com_distance_m * 9.81
    assert weight * math.sin(lean) == pytest.approx(0.005 * (lean - math.pi)) and lean < -0.1
    assert lean + other_lean == pytest.approx(2 * math.pi)


def test_a_measured_torque_leans_the_pole() -> None:
    """Without its lean, a rig with a notched bearing stood 0.2 m beside the middle."""
    knots = spread_turn(12)
    torques = 0.016 * np.cos(3 * np.asarray(knots))
    law = Law(tuple(knots), tuple(torques.tolist()))
    lean = find_upright(replace(make_twin(), measured_laws={"pole_torque_by_angle": law}))
    weight = RIG.total_mass_kg * RIG.com_distance_m * 9.81
    push = 0.016 * math.cos(3 * lean.angle_rad)
    assert weight * math.sin(lean.angle_rad) == pytest.approx(-push, rel=0.05)
    assert lean.angle_rad < -0.1


def test_a_pole_that_stands_by_itself_is_refused() -> None:
    with pytest.raises(BadInputError, match="expected a pole that falls"):
        find_upright(make_twin(pole_spring={"n_m_per_rad": 1.0}))


@pytest.mark.parametrize(
    "effects", [{}, {"input_delay": {"delay_s": 0.1}}, {"motor_lag": {"time_constant_s": 0.08}}]
)
def test_the_closed_loop_is_stable_where_the_open_one_falls(
    effects: dict[str, dict[str, float]],
) -> None:
    linear = make_map(**effects)
    a, b = linear.augmented
    assert np.abs(np.linalg.eigvals(linear.state)).max() > 1.2
    assert (
        np.abs(np.linalg.eigvals(a - b @ design_regulator(linear, WEIGHTS, 10.0)[None])).max()
        < 0.999
    )


def test_a_drive_without_force_balances_nothing() -> None:
    linear = make_map()
    with pytest.raises(BadInputError, match="expected a rig that its drive can balance"):
        design_regulator(type(linear)(linear.state, 0.0 * linear.drive), WEIGHTS, 10.0)
