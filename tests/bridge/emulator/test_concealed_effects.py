"""Known answers: each concealed effect does what physics says, at its place of the chain."""

import math
from dataclasses import replace

import numpy as np
import pytest

from pendulum_bridge.emulator.drive import make_drive
from pendulum_bridge.emulator.rig import EmulatedRig
from pendulum_bridge.emulator.seal import Concealed
from pendulum_bridge.emulator.sensors import Encoders, Sensors, distort_positions
from pendulum_twin.rig import Rig

EXACT = Encoders(pole_counts=0, cart_step_m=0.0)
MASS, INERTIA = 0.6923, 0.00292


@pytest.fixture
def apart(endless: Rig) -> Rig:
    """Return a rig without viscous friction whose balanced pole moves independently."""
    return replace(endless, com_distance_m=0.0, cart_viscous_n_s_m=0.0, pole_viscous_n_m_s=0.0)


def truth_after(
    rig: Rig, effects: dict, seconds: float, start=(0.0, math.pi, 0.0, 0.0), command=0.0
) -> np.ndarray:
    emulator = EmulatedRig(Concealed(effects, rig), encoders=EXACT, start=start)
    for _ in range(round(seconds * 100)):
        emulator.step(command)
    return emulator.truth


@pytest.mark.parametrize(
    ("effects", "sent", "expected"),
    [
        ({"input_sign_inverted": {}}, [0.3, -0.1], [-0.3, 0.1]),
        ({"input_delay": {"delay_s": 0.002}}, [0.1, 0.2, 0.3, 0.4], [0.0, 0.0, 0.1, 0.2]),
        ({"input_delay": {"delay_s": 0.0005}}, [0.1, 0.2, 0.2], [0.05, 0.15, 0.2]),
        ({"input_dead_zone": {"width": 0.1}}, [0.3, 0.1, -0.05, -0.3], [0.2, 0.0, 0.0, -0.2]),
        ({"input_saturation": {"limit": 0.25}}, [0.3, 0.1, -0.4], [0.25, 0.1, -0.25]),
        ({"gain_asymmetry": {"ratio": 0.1}}, [0.2, -0.2], [0.22, -0.18]),
        ({"gain_drift": {"per_s": 2.0}}, [0.1, 0.1], [0.1001, 0.1003]),
        ({"gain_drift": {"per_s": -500.0}}, [0.1, 0.1, 0.1], [0.075, 0.025, 0.01]),
        ({"gain_drift": {"per_s": 8000.0}}, [0.1, 0.1, 0.1], [0.5, 1.0, 1.0]),
        ({"input_dead_zone": {"width": 0.1}, "gain_asymmetry": {"ratio": 0.1}}, [0.3], [0.22]),
    ],
)
def test_command_stages(effects: dict, sent: list[float], expected: list[float]) -> None:
    stage = make_drive(effects, 1e-3)
    assert [stage(u) for u in sent] == pytest.approx(expected)


@pytest.mark.parametrize(("ramp_s", "rising"), [(0.0123, 12.3), (0.1, 100.0)])
def test_the_ramp_arrives_when_it_should_and_turns_round_at_once(ramp_s, rising) -> None:
    stage = make_drive({"drive_slew_limit": {"ramp_s": ramp_s}}, 1e-3)
    up = np.array([stage(1.0) for _ in range(200)])
    assert np.sum(1.0 - up) * 1e-3 == pytest.approx(ramp_s / 2)  # the triangle that is lost
    assert up[:12] == pytest.approx((np.arange(12) + 0.5) / rising)
    assert np.all(up[101:] == 1.0)
    assert stage(-1.0) == pytest.approx(1.0 - 0.5 / rising)


def test_the_lag_rises_with_its_time_constant() -> None:
    stage = make_drive({"motor_lag": {"time_constant_s": 0.05}}, 1e-3)
    risen = [stage(1.0) for _ in range(200)]
    assert risen[49] == pytest.approx(1 - math.exp(-49.5e-3 / 0.05), rel=1e-9)
    assert risen[-1] == pytest.approx(1 - math.exp(-199.5e-3 / 0.05), rel=1e-9)


def test_the_delay_reaches_the_cart(apart: Rig) -> None:
    effects = {"input_delay": {"delay_s": 0.03}}
    assert truth_after(apart, effects, 0.03, command=0.2)[2] == 0.0
    acceleration = 12.86 * 0.2 / MASS
    assert truth_after(apart, effects, 0.13, command=0.2)[2] == pytest.approx(
        0.1 * acceleration, rel=1e-6
    )


def test_coulomb_friction_stops_the_cart_where_the_closed_form_says(apart: Rig) -> None:
    effects = {"cart_coulomb_friction": {"level_n": 0.8}}
    after = truth_after(apart, effects, 2.0, start=(0.0, math.pi, 0.6, 0.0))
    assert after[0] == pytest.approx(MASS * 0.6**2 / (2 * 0.8), abs=1e-6)
    assert abs(after[2]) < 1e-7


def test_coulomb_friction_holds_the_cart_up_to_its_level(apart: Rig) -> None:
    effects = {"cart_coulomb_friction": {"level_n": 0.8}}
    assert abs(truth_after(apart, effects, 2.0, command=0.95 * 0.8 / 12.86)[0]) < 1e-6
    pushed = truth_after(apart, effects, 1.0, command=1.5 * 0.8 / 12.86)
    assert pushed[2] == pytest.approx(0.5 * 0.8 / MASS, rel=1e-3)


def test_stribeck_friction_holds_more_than_it_brakes(apart: Rig) -> None:
    effects = {"cart_stribeck_friction": {"level_n": 0.4, "static_n": 0.4, "velocity_m_s": 0.05}}
    command = 0.6 / 12.86  # between level and level + static
    assert abs(truth_after(apart, effects, 1.0, command=command)[0]) < 1e-6
    moving = truth_after(apart, effects, 1.0, start=(0.0, math.pi, 0.5, 0.0), command=command)
    assert moving[2] == pytest.approx(0.5 + 0.2 / MASS, rel=1e-4)


def test_quadratic_drag_follows_its_closed_form(apart: Rig) -> None:
    after = truth_after(
        apart, {"cart_quadratic_drag": {"n_s2_m2": 1.2}}, 1.0, start=(0.0, math.pi, -2.0, 0.0)
    )
    assert after[2] == pytest.approx(-2.0 / (1 + 1.2 * 2.0 / MASS), rel=1e-6)
    turned = truth_after(
        apart, {"pole_quadratic_drag": {"n_m_s2": 3e-4}}, 1.0, start=(0.0, 0.0, 0.0, 9.0)
    )
    assert turned[3] == pytest.approx(9.0 / (1 + 3e-4 * 9.0 / INERTIA), rel=1e-6)


def test_a_tilted_rail_pulls_with_the_weight(apart: Rig) -> None:
    after = truth_after(apart, {"rail_tilt": {"angle_rad": -0.02}}, 1.0)
    assert after[2] == pytest.approx(-9.81 * math.sin(0.02), rel=1e-6)


def test_springs_swing_with_their_closed_form(apart: Rig) -> None:
    after = truth_after(apart, {"rail_spring": {"n_per_m": 2.0, "centre_m": 0.1}}, 0.5)
    assert after[0] == pytest.approx(0.1 - 0.1 * math.cos(0.5 * math.sqrt(2.0 / MASS)), rel=1e-6)
    turned = truth_after(
        apart, {"pole_spring": {"n_m_per_rad": 0.01}}, 0.5, start=(0.0, math.pi + 1, 0.0, 0.0)
    )
    assert turned[1] - math.pi == pytest.approx(
        math.cos(0.5 * math.sqrt(0.01 / INERTIA)), rel=1e-6
    )


def test_the_bearing_stops_the_pole_in_the_time_of_the_closed_form(apart: Rig) -> None:
    effects = {"pole_coulomb_friction": {"level_n_m": 0.004}}
    after = truth_after(apart, effects, 3.0, start=(0.0, 0.0, 0.0, 2.0))
    assert after[1] == pytest.approx(INERTIA * 2.0**2 / (2 * 0.004), abs=1e-5)


def test_sensor_effects_change_what_is_shown_and_nothing_else() -> None:
    state = np.array([0.2, 3.0, 0.0, 0.0])
    assert distort_positions(state, {}) == (0.2, 3.0)
    assert distort_positions(state, {"angle_offset": {"angle_rad": 0.1}}) == pytest.approx(
        (0.2, 3.1)
    )
    assert distort_positions(state, {"cart_sign_inverted": {}}) == (-0.2, 3.0)
    assert distort_positions(state, {"angle_sign_inverted": {}}) == pytest.approx(
        (0.2, 2 * math.pi - 3.0)
    )


def test_encoders_count_in_steps_and_never_wrap() -> None:
    sensors = Sensors(Encoders(), {}, 0.01)
    sample = sensors.measure(np.array([0.0123456, 40.0, 0.0, 0.0]))
    assert sample[0] / 57e-6 == pytest.approx(round(sample[0] / 57e-6), abs=1e-9)
    assert sample[1] / (2 * math.pi / 4096) == pytest.approx(
        round(sample[1] / (2 * math.pi / 4096)), abs=1e-7
    )
    assert abs(sample[0] - 0.0123456) <= 28.5e-6 and abs(sample[1] - 40.0) <= math.pi / 4096


def test_reported_velocities_are_filtered_differences() -> None:
    sensors = Sensors(EXACT, {"velocity_filter": {"time_constant_s": 0.02}}, 0.01)
    reported = [sensors.measure(np.array([0.01 * k, 0.0, 1.0, 0.0]))[2] for k in range(60)]
    assert reported[0] == 0.0
    assert reported[2] == pytest.approx(1 - math.exp(-1.0))
    assert reported[-1] == pytest.approx(1.0)


def test_spikes_come_at_their_rate() -> None:
    sensors = Sensors(Encoders(spike_rate=0.05), {}, 0.01, seed=3)
    shown_positions = np.array(
        [sensors.measure(np.array([0.0, math.pi, 0.0, 0.0]))[0] for _ in range(2000)]
    )
    assert 60 < np.sum(np.abs(shown_positions) > 0.04) < 140


def test_the_known_limit_clips_what_is_sent(apart: Rig) -> None:
    assert truth_after(apart, {}, 0.1, command=3.0)[2] == pytest.approx(
        0.1 * 0.5 * 12.86 / MASS, rel=1e-6
    )
