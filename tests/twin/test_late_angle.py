"""A run shows the pole as it was, and begins where the pole is by then."""

import numpy as np
import pytest
from support.twin_rigs import THESIS, recording, wild_command

from pendulum_twin.free_runs import run_freely
from pendulum_twin.inverse_dynamics import compute_missing_force
from pendulum_twin.late_angle import compute_delays, drop_delays, look_ahead, look_back
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import make_theta
from pendulum_twin.sensors import apply_sensors, undo_sensors

PERIOD_S, DELAY_S = 0.01, 0.0234
LATE = make_theta(Twin("late", THESIS, {"angle_delay": {"delay_s": DELAY_S}}))[None]
PROMPT = make_theta(Twin("prompt", THESIS))[None]
HANGING = (0.0, np.pi, 0.0, 0.0)


def run_windows(signals, theta, begin, starts, samples):
    begin = np.asarray(begin)
    return run_freely(signals, theta, np.zeros_like(begin), begin, np.array(starts), samples)


@pytest.fixture(scope="module")
def whole():
    """Return signals, and the run from rest of the twin that reads the angle late."""
    signals = recording(wild_command(300), PERIOD_S)
    return signals, run_windows(signals, LATE, [0], [HANGING], 300)[0]


def test_a_run_that_begins_in_the_middle_goes_on_as_the_whole_run(whole):
    signals, shown = whole
    begin = np.array([40, 90, 153, 200])
    late = run_windows(signals, LATE, begin, shown[begin], 50)
    expected = shown[begin[:, None] + np.arange(50)]
    assert late[:, 0] == pytest.approx(expected[:, 0], abs=1e-12)
    assert np.max(np.abs(late - expected)[..., :2]) < 2e-3
    prompt = run_windows(signals, PROMPT, begin, shown[begin], 50)
    assert np.max(np.abs(prompt - expected)[..., :2]) > 0.03


def test_the_motion_of_a_late_angle_lacks_no_torque(whole):
    signals, shown = whole
    accelerations = np.gradient(shown[:, 2:], PERIOD_S, axis=0)
    lacking, _ = compute_missing_force(signals, shown, accelerations, LATE[0])
    without, _ = compute_missing_force(signals, shown, accelerations, PROMPT[0])
    inner = slice(5, -5)
    assert np.std(lacking[inner, 1]) < 0.25 * np.std(without[inner, 1])


def test_looking_back_undoes_looking_ahead():
    t = np.arange(200) * PERIOD_S
    states = np.stack([0 * t, np.sin(3 * t), 0 * t, 3 * np.cos(3 * t)], axis=1)
    signals = recording(np.zeros(200), PERIOD_S)
    ahead, later = look_ahead(signals, states, np.stack([t, -9 * np.sin(3 * t)], axis=1), DELAY_S)
    inner = slice(0, -3)
    assert ahead[inner, 1] == pytest.approx(np.sin(3 * (t + DELAY_S))[inner], abs=1e-6)
    assert ahead[inner, 3] == pytest.approx(3 * np.cos(3 * (t + DELAY_S))[inner], abs=1e-4)
    assert later[inner, 1] == pytest.approx(-9 * np.sin(3 * (t + DELAY_S))[inner], abs=2e-3)
    end, rate = np.sin(3 * t[-1]), 3 * np.cos(3 * t[-1])
    assert ahead[-1, 1] == pytest.approx(end + DELAY_S * rate)  # the last state moves on
    back = look_back(states[:1], ahead[None], np.array([DELAY_S]), PERIOD_S, np.array([1.0]))[0]
    assert back[inner, 1] == pytest.approx(states[inner, 1], abs=1e-5)
    assert np.array_equal(back[:, 0], states[:, 0])


def test_a_late_angle_is_undone_beside_a_wrong_clock():
    """The rate by which a single state looks back is the same both ways."""
    effects = {"angle_delay": {"delay_s": DELAY_S}, "sample_period_error": {"ratio": 0.2}}
    theta, t = make_theta(Twin("both", THESIS, effects))[None], np.zeros(1)
    states = np.array([[0.1, 2.0, -0.3, 5.0]])
    shown = apply_sensors(states, theta, t)
    assert abs(shown[0, 1] - 2.0) > 0.05 and shown[0, 3] != 5.0
    assert undo_sensors(shown, theta, t) == pytest.approx(states, rel=1e-12)


def test_a_single_state_looks_back_by_the_stamps_as_a_run_does():
    effects = {"angle_delay": {"delay_s": DELAY_S}, "sample_period_error": {"ratio": 0.2}}
    theta, pace, rate = make_theta(Twin("both", THESIS, effects))[None], 1.0 / 1.2, 5.0
    t = np.arange(20) * PERIOD_S
    true = np.stack([0 * t, rate * pace * t, 0 * t, rate + 0 * t], axis=1)  # by true time
    alone = apply_sensors(true, np.repeat(theta, 20, axis=0), t)
    before = np.array([[0.0, -rate * pace * DELAY_S, 0.0, rate]])
    back = look_back(before, true[None], np.array([DELAY_S]), PERIOD_S, np.array([pace]))[0]
    assert alone[:, 1] == pytest.approx(back[:, 1], abs=1e-12)


def test_delays_are_of_twins_and_can_be_dropped():
    both = np.concatenate([LATE, PROMPT])
    assert compute_delays(both) == pytest.approx([DELAY_S, 0.0])
    assert np.array_equal(drop_delays(both), np.concatenate([PROMPT, PROMPT]))
    assert compute_delays(both)[0] == pytest.approx(DELAY_S)  # the twins stay as they are


def test_a_run_that_diverged_stays_without_end():
    """As other runs do, without a warning: such errors count as infinite."""
    states = np.tile([0.0, 1.0, 0.0, 2.0], (2, 5, 1))
    states[1, 1:] = np.inf
    back = look_back(states[:, 0], states, np.full(2, DELAY_S), PERIOD_S, np.ones(2))
    assert np.all(np.isfinite(back[0])) and not np.isfinite(back[1, -1, 1])


@pytest.mark.parametrize("delay_s", [5e-324, 1e-30, 1e-12])
def test_a_delay_that_is_next_to_nothing_shows_the_pole_as_it_is(delay_s):
    """A fit that ends next to its bound leaves such values."""
    theta = make_theta(Twin("fine", THESIS, {"angle_delay": {"delay_s": delay_s}}))[None]
    signals, start = recording(wild_command(60), PERIOD_S), (0.0, 2.5, 0.2, 1.0)
    fine, prompt = (run_windows(signals, t, [0], [start], 60) for t in (theta, PROMPT))
    assert np.array_equal(fine, prompt)
