"""Many live twins in one compiled call are the very twins that a stepper runs one by one."""

import numpy as np
import pytest
from support.hidden_physics import HIDDEN, INTECO

from pendulum_twin import lanes
from pendulum_twin.encoders import Encoders
from pendulum_twin.laws.law import Law
from pendulum_twin.model import Twin
from pendulum_twin.stepper import Stepper

AT_REST = (0.0, 0.0, 0.0, 0.0)
TIMING = lanes.make_timing(0.03, 3)


def start_lanes(kinds: lanes.Kinds, count: int) -> lanes.Lanes:
    batch = lanes.make_lanes(kinds, TIMING, count)
    for i in range(count):
        lanes.begin_lane_from_python(kinds, batch, TIMING, i, i % len(kinds.theta), AT_REST)
    return batch


def run_beside_steppers(twins: list[Twin]) -> tuple[np.ndarray, np.ndarray]:
    """Return what is shown after 60 random commands: by lanes, and by a stepper each."""
    kinds = lanes.make_kinds(twins, TIMING)
    running, code = start_lanes(kinds, len(twins)), lanes.select_lane_code(kinds, len(twins))
    alone = [Stepper(twin, 0.01) for twin in twins]
    random = np.random.default_rng(3)
    for _ in range(60):
        commands = random.uniform(-0.5, 0.5, len(twins))
        lanes.advance_lanes_from_python(code, kinds, running, TIMING, commands)
        for stepper, command in zip(alone, commands, strict=True):
            for _ in range(3):
                stepper.step(command)
    return running.shown, np.array([stepper.state for stepper in alone])


@pytest.mark.parametrize("name", HIDDEN)
def test_every_effect_gives_the_same_bits_as_one_step_at_a_time(name: str) -> None:
    shown, wanted = run_beside_steppers([Twin(name, INTECO.rig, {name: HIDDEN[name]})])
    assert np.array_equal(shown, wanted)


def test_lanes_of_different_twins_run_side_by_side() -> None:
    shown, wanted = run_beside_steppers(
        [Twin(name, INTECO.rig, {name: values}) for name, values in HIDDEN.items()]
    )
    assert shown == pytest.approx(
        wanted, rel=1e-9, abs=1e-12
    )  # one code holds all laws: their zeros round otherwise


def test_what_is_late_is_late_from_the_first_command_on() -> None:
    twin = Twin("late", INTECO.rig, {"input_delay": {"delay_s": 0.03}})
    kinds = lanes.make_kinds([twin], TIMING)
    running, code = start_lanes(kinds, 1), lanes.select_lane_code(kinds, 1)
    lanes.advance_lanes_from_python(code, kinds, running, TIMING, np.array([0.5]))
    assert abs(running.shown[0, 0]) < 1e-12
    lanes.advance_lanes_from_python(code, kinds, running, TIMING, np.array([0.5]))
    assert running.shown[0, 0] > 0.003


def test_a_lane_shows_velocities_by_a_clock_that_wanders() -> None:
    law = Law((0.0, 1.0, 2.0), (0.0, 0.1, -0.1))
    twin = Twin("wanders", INTECO.rig, measured_laws={"clock_pace_over_time": law})
    shown, wanted = run_beside_steppers([twin, Twin("even", INTECO.rig)])
    np.testing.assert_allclose(shown, wanted, atol=1e-12)
    assert np.max(np.abs(shown[0] - shown[1])) > 1e-3


def test_a_lane_begins_anew_with_nothing_left() -> None:
    twin = Twin(
        "late",
        INTECO.rig,
        {"input_delay": {"delay_s": 0.05}, "motor_lag": {"time_constant_s": 0.05}},
    )
    kinds = lanes.make_kinds([twin], TIMING)
    running, code = start_lanes(kinds, 2), lanes.select_lane_code(kinds, 2)
    for _ in range(10):
        lanes.advance_lanes_from_python(code, kinds, running, TIMING, np.array([0.5, 0.5]))
    lanes.begin_lane_from_python(kinds, running, TIMING, 0, 0, AT_REST)
    fresh = start_lanes(kinds, 2)
    for _ in range(5):
        lanes.advance_lanes_from_python(code, kinds, running, TIMING, np.array([0.1, 0.1]))
        lanes.advance_lanes_from_python(code, kinds, fresh, TIMING, np.array([0.1, 0.1]))
    assert np.array_equal(running.shown[0], fresh.shown[0]) and not np.array_equal(
        running.shown[1], fresh.shown[1]
    )


@pytest.mark.parametrize("step", [1e-3, 2 * np.pi / 512])
def test_encoders_show_whole_steps_and_rates_are_their_differences(step: float) -> None:
    kinds = lanes.make_kinds([INTECO], TIMING, Encoders(step, step))
    running, code = start_lanes(kinds, 1), lanes.select_lane_code(kinds, 1)
    stepper, before = Stepper(INTECO, 0.01), running.shown[0].copy()
    for k in range(100):
        command = 0.4 * np.sin(0.3 * k)
        lanes.advance_lanes_from_python(code, kinds, running, TIMING, np.array([command]))
        exact = [stepper.step(command) for _ in range(3)]
        shown = running.shown[0]
        assert shown[:2] == pytest.approx(np.rint(exact[-1][:2] / step) * step, abs=1e-12)
        assert shown[2:] == pytest.approx(
            (shown[:2] - np.rint(exact[-2][:2] / step) * step) / 0.01, abs=1e-9
        )
    assert not np.array_equal(before, running.shown[0])
