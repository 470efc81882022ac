"""A sensor follows the angle with a first-order lag; a run begins where the pole really is."""

import numpy as np
import pytest
from support.twin_rigs import THESIS, recording, wild_command

from pendulum_twin.free_runs import run_freely
from pendulum_twin.inverse_dynamics import compute_missing_force
from pendulum_twin.lagging_angle import compute_lags, follow_angle, lead_angle
from pendulum_twin.late_angle import drop_delays
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import make_theta

PERIOD_S, LAG_S = 0.01, 0.0164


def make_twin(**effects):
    return make_theta(Twin("twin", THESIS, effects))[None]


LAGGING = make_twin(angle_lag={"time_constant_s": LAG_S})
BOTH = make_twin(angle_lag={"time_constant_s": LAG_S}, angle_delay={"delay_s": 0.0123})
PROMPT = make_twin()
HANGING = (0.0, np.pi, 0.0, 0.0)


def run_windows(signals, theta, begin, starts, samples):
    begin = np.asarray(begin)
    return run_freely(signals, theta, np.zeros_like(begin), begin, np.array(starts), samples)


def run_from_rest(theta, repeats=1):
    """Return signals and the run; repeats: samples a sample of the command is cut into."""
    command = np.repeat(wild_command(300), repeats)
    signals = recording(command, PERIOD_S / repeats)
    return signals, run_windows(signals, theta, [0], [HANGING], 300 * repeats)[0]


def test_the_sensor_shows_the_first_order_lag_of_the_angle():
    fine = run_from_rest(PROMPT, 100)[1]
    shown, keep = [np.pi], np.exp(-1e-4 / LAG_S)
    for true in 0.5 * (fine[1:, 1] + fine[:-1, 1]):
        shown.append(keep * shown[-1] + (1 - keep) * true)
    run = run_from_rest(LAGGING)[1]
    assert run[:, 1] == pytest.approx(np.array(shown)[::100], abs=1e-4)
    rates = np.gradient(shown, 1e-4)[::100]
    assert run[1:, 3] == pytest.approx(rates[1:], abs=0.02)
    assert run[:, [0, 2]] == pytest.approx(fine[::100, [0, 2]], abs=1e-9)


@pytest.mark.parametrize("theta", [LAGGING, BOTH], ids=["lag", "lag and delay"])
def test_a_run_that_begins_in_the_middle_goes_on_as_the_whole_run(theta):
    signals, shown = run_from_rest(theta)
    begin = np.array([40, 90, 153, 200])
    late = run_windows(signals, theta, begin, shown[begin], 50)
    expected = shown[begin[:, None] + np.arange(50)]
    assert late[:, 0] == pytest.approx(expected[:, 0], abs=1e-12)
    prompt = run_windows(signals, PROMPT, begin, shown[begin], 50)
    errors = [np.max(np.abs(run - expected)[..., :2]) for run in (late, prompt)]
    assert errors[0] < 0.25 * errors[1]  # 0.21: the start's rate is known by a mean alone


@pytest.mark.parametrize("delay_s", [0.0, 0.0123])
def test_a_run_begins_with_its_start_state_whatever_the_clock_s_pace(delay_s):
    theta = make_twin(
        angle_lag={"time_constant_s": LAG_S},
        angle_delay={"delay_s": delay_s},
        sample_period_error={"ratio": 0.06},
    )
    signals, start = recording(wild_command(20), PERIOD_S), (0.1, 2.0, 0.3, 5.0)
    first = run_windows(signals, theta, [5], [start], 10)[0, 0]
    assert first == pytest.approx(start, abs=1e-9)


def test_the_motion_behind_a_lagging_sensor_lacks_no_torque():
    signals, shown = run_from_rest(LAGGING)
    accelerations = np.gradient(shown[:, 2:], PERIOD_S, axis=0)
    lacking, _ = compute_missing_force(signals, shown, accelerations, LAGGING[0])
    without, _ = compute_missing_force(signals, shown, accelerations, PROMPT[0])
    inner = slice(5, -5)
    assert np.std(lacking[inner, 1]) < 0.3 * np.std(without[inner, 1])


def test_the_lead_undoes_the_lag():
    t = np.arange(200) * PERIOD_S
    states = np.stack([0 * t, np.sin(3 * t), 0 * t, 3 * np.cos(3 * t)], axis=1)
    signals = recording(np.zeros(200), PERIOD_S)
    turns = np.stack([t, -9 * np.sin(3 * t)], axis=1)
    ahead, _ = lead_angle(signals, states, turns, LAG_S)
    lag, pace = np.array([LAG_S]), np.array([1.0])
    back = follow_angle(states[:1], ahead[None], lag, PERIOD_S, pace)[0]
    assert back[:, 1] == pytest.approx(states[:, 1], abs=1e-5)
    assert back[:, 3] == pytest.approx(states[:, 3], abs=1e-3)
    assert np.array_equal(back[:, [0, 2]], states[:, [0, 2]])


def test_lags_are_of_twins_and_can_be_dropped():
    both = np.concatenate([LAGGING, PROMPT])
    assert compute_lags(both) == pytest.approx([LAG_S, 0.0])
    assert np.array_equal(drop_delays(both), np.concatenate([PROMPT, PROMPT]))


def test_a_run_that_diverged_stays_without_end():
    states = np.tile([0.0, 1.0, 0.0, 2.0], (2, 5, 1))
    states[1, 1:] = np.inf
    shown = follow_angle(states[:, 0], states, np.full(2, LAG_S), PERIOD_S, np.ones(2))
    assert np.all(np.isfinite(shown[0])) and not np.isfinite(shown[1, -1, 1])


@pytest.mark.parametrize("lag_s", [5e-324, 1e-30, 1e-12])
def test_a_lag_that_is_next_to_nothing_shows_the_pole_as_it_is(lag_s):
    theta = make_twin(angle_lag={"time_constant_s": lag_s})
    signals, start = recording(wild_command(60), PERIOD_S), (0.0, 2.5, 0.2, 1.0)
    fine, prompt = (run_windows(signals, t, [0], [start], 60) for t in (theta, PROMPT))
    assert np.array_equal(fine, prompt)
