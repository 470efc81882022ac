"""Readings that no rig gives: a sensor at its end, a slip, a filter, a command of another run."""

from dataclasses import replace

import numpy as np
import pytest
from support.degraded import make_raw
from support.hidden_physics import CART_STEP_M, POLE_STEP_RAD, make_command, record_hidden
from support.made_recordings import INTECO, PERIOD_S, made, made_states

from pendulum_sysid.cleaning.causality import check_causality, measure_lead
from pendulum_sysid.cleaning.clean import clean_recording
from pendulum_sysid.cleaning.command_answer import follows_command
from pendulum_sysid.cleaning.reducing import reduce_rate
from pendulum_sysid.cleaning.slips import find_slips
from pendulum_sysid.cleaning.smooth_state import smooth_state
from pendulum_sysid.errors import UnusableRecording
from pendulum_sysid.prepare import prepare_case
from pendulum_twin.laws.law import Law
from pendulum_twin.model import Twin
from pendulum_twin.plans.excitation import make_standard_plan
from pendulum_twin.signals import Signals

RAW = make_raw(30.0)
CLEAN = clean_recording(RAW)
STICKY = Twin("sticky", INTECO.rig, {"cart_coulomb_friction": {"level_n": 0.9}})
# A drive whose force falls along the rail and turns round at 0.8 m.
TURNING = Twin(
    "turning",
    INTECO.rig,
    measured_laws={"drive_gain_along_rail": Law((-4.0, 4.0), (5.0, -5.0))},
)


def test_a_pole_beyond_the_end_of_its_sensor_is_left_out() -> None:
    low, high = np.quantile(RAW.pole, [0.1, 0.9])
    found = clean_recording(replace(RAW, pole=np.clip(RAW.pole, low, high)))
    [clipped] = [finding for finding in found.findings if "reading stays" in finding.note]
    assert clipped.kind == "clipped" and clipped.count > 5
    assert not np.any((found.signals.pole == high) & found.signals.pole_valid)


def test_turning_points_are_no_end_of_a_sensor() -> None:
    step = 2 * np.pi / 4096
    found = clean_recording(replace(RAW, pole=step * np.rint(RAW.pole / step)))
    assert found.findings == ()


@pytest.mark.parametrize("distance_m", [0.03, -0.05])
def test_a_slip_is_found_and_left_out(distance_m: float) -> None:
    slipped = RAW.cart + distance_m * np.clip((RAW.state_stamp_s - 15.0) / 0.2, 0.0, 1.0)
    recording = clean_recording(replace(RAW, cart=slipped))
    [slip] = find_slips(recording.signals, smooth_state(recording.signals))
    assert slip.distance_m == pytest.approx(distance_m, rel=0.3)
    case = prepare_case([recording], INTECO)
    assert [finding.kind for finding in case.recording.findings] == ["slip"]
    assert not case.signals.cart_valid[1500:1520].any()


@pytest.mark.parametrize("twin", [INTECO, STICKY], ids=["bare", "sticky"])
def test_a_rig_that_does_not_slip_is_left_alone(twin: Twin) -> None:
    signals = made(twin, 30.0, amplitude=0.3).signals
    assert find_slips(signals, smooth_state(signals)) == []


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_drive_that_saturates_is_no_slip_and_a_slip_on_it_is_found(seed: int) -> None:
    """The balance with a straight drive departs wherever the command is largest."""
    signals = record_hidden({"input_saturation": {"limit": 0.12}}, seed, 60.0)[0].signals
    assert find_slips(signals, smooth_state(signals)) == []
    moved = 0.05 * np.clip((signals.times_s - 25.0) / 0.1, 0.0, 1.0)
    slipped = replace(signals, cart=signals.cart + moved)
    [slip] = find_slips(slipped, smooth_state(slipped))
    assert signals.times_s[slip.first] == pytest.approx(25.0, abs=0.3)


@pytest.mark.parametrize("seed", [3, 4, 6])
def test_a_drive_that_lags_is_no_slip_and_a_slip_on_it_is_found(seed: int) -> None:
    """Behind a step of the command a lag of 60 ms pushes on the old way for 0.2 s."""
    command = np.array(make_standard_plan(seconds=60, seed=seed).commands)
    lagging = replace(INTECO, effects={"motor_lag": {"time_constant_s": 0.06}})
    cart, pole = (
        step * np.rint(made_states(lagging, command)[:, column] / step)
        for column, step in enumerate((CART_STEP_M, POLE_STEP_RAD))
    )
    every = np.ones(len(command), dtype=bool)
    signals = Signals(PERIOD_S, command, cart, pole, every, every)
    assert find_slips(signals, smooth_state(signals)) == []
    moved = 0.012 * np.clip((signals.times_s - 20.0) / 0.1, 0.0, 1.0)
    slipped = replace(signals, cart=cart + moved)
    [slip] = find_slips(slipped, smooth_state(slipped))
    assert signals.times_s[slip.first] == pytest.approx(20.0, abs=0.3)


@pytest.mark.parametrize("seed", [2, 4])
def test_a_gain_that_changes_along_the_rail_is_no_slip(seed: int) -> None:
    """Where the gain is far from its mean, a strong command moves the cart by surprise."""
    rising = replace(
        INTECO, measured_laws={"drive_gain_along_rail": Law((-2.0, 2.0), (-2.0, 2.0))}
    )
    command = make_command(seed, 6000)
    states, every = made_states(rising, command), np.ones(6000, dtype=bool)
    cart, pole = (
        step * np.rint(values / step)
        for step, values in ((CART_STEP_M, states[:, 0]), (POLE_STEP_RAD, states[:, 1]))
    )
    signals = Signals(PERIOD_S, command, cart, pole, every, every)
    assert find_slips(signals, smooth_state(signals)) == []
    moved = 0.05 * np.clip((signals.times_s - 15.0) / 0.1, 0.0, 1.0)
    slipped = replace(signals, cart=cart + moved)
    [slip] = find_slips(slipped, smooth_state(slipped))
    assert signals.times_s[slip.first] == pytest.approx(15.0, abs=0.3)


@pytest.mark.parametrize(
    ("level_n", "static_n", "seed"), [(0.9, 1.1, 2), (1.5, 1.6, 3), (1.3, 2.4, 3)]
)
def test_a_cart_that_sticks_and_breaks_away_does_not_slip(
    level_n: float, static_n: float, seed: int
) -> None:
    sizes = {"level_n": level_n, "static_n": static_n, "velocity_m_s": 0.05}
    signals = record_hidden({"cart_stribeck_friction": sizes}, seed, 20.0)[0].signals
    assert find_slips(signals, smooth_state(signals)) == []


def average(values: np.ndarray, samples: int) -> np.ndarray:
    return np.convolve(
        np.pad(values, samples // 2, mode="edge"), np.full(samples, 1 / samples), "valid"
    )


def make_rough(twin: Twin = INTECO) -> Signals:
    """Return a run of the twin under a rough command, which no smooth command replaces."""
    from support.made_recordings import CART_NOISE_M, POLE_NOISE_RAD, made_states

    noise = np.random.default_rng(3)
    command = np.repeat(noise.uniform(-0.2, 0.2, 300), 10)
    states = made_states(twin, command)
    cart = states[:, 0] + noise.normal(0.0, CART_NOISE_M, len(command))
    pole = states[:, 1] + noise.normal(0.0, POLE_NOISE_RAD, len(command))
    return replace(CLEAN.signals, command=command, cart=cart, pole=pole)


def test_positions_that_move_before_the_command_are_refused() -> None:
    signals = make_rough()
    check_causality(signals, smooth_state(signals))
    smoothed = replace(signals, cart=average(signals.cart, 11), pole=average(signals.pole, 11))
    with pytest.raises(UnusableRecording, match="before: positions that were smoothed"):
        check_causality(smoothed, smooth_state(smoothed))
    lead = measure_lead(smoothed, smooth_state(smoothed))
    assert lead is not None and lead.share == pytest.approx(3 / 11, rel=0.3)


@pytest.mark.parametrize("twin", [INTECO, STICKY, TURNING], ids=["bare", "sticky", "turning"])
def test_the_right_command_is_followed_and_another_is_not(twin: Twin) -> None:
    signals = make_rough(twin)
    if twin is TURNING:
        assert 0.2 < np.mean(signals.cart > 0.8) < 0.8, "it is driven both ways"
    assert follows_command(signals, smooth_state(signals))
    other = replace(signals, command=signals.command[::-1].copy())
    assert not follows_command(other, smooth_state(other))


@pytest.mark.parametrize(("stiffness_n_m", "end_m"), [(2000.0, 0.2), (60.0, 0.2)])
def test_a_cart_that_hits_buffers_follows_the_command(stiffness_n_m: float, end_m: float) -> None:
    """Impacts are larger than all that the drive does, and no command explains them.

    A recording whose cart hit springs at both ends was refused, with the advice to check the
    command's topic.
    """
    at = np.linspace(-0.6, 0.6, 120)
    pressed = np.maximum(at - end_m, 0.0) + np.minimum(at + end_m, 0.0)
    buffers = {"cart_force_by_position": Law(tuple(at), tuple(-stiffness_n_m * pressed))}
    random = np.random.default_rng(0)
    lengths = np.round(random.uniform(0.4, 1.6, 60) / PERIOD_S).astype(int)
    command = 0.2 * np.repeat(np.where(np.arange(60) % 2, -1.0, 1.0), lengths)[:3000]
    states = made_states(Twin("buffers", INTECO.rig, measured_laws=buffers), command)
    cart = states[:, 0] + random.normal(0.0, 1e-5, len(command))
    pole = states[:, 1] + random.normal(0.0, 5e-4, len(command))
    every = np.ones(len(command), dtype=bool)
    signals = Signals(PERIOD_S, command, cart, pole, every, every)
    assert 0.05 < np.mean(np.abs(cart) > end_m) < 0.5, "it hits them"
    state = smooth_state(signals)
    assert follows_command(signals, state)
    for other in (command[::-1].copy(), np.roll(command, 700)):
        assert not follows_command(replace(signals, command=other), state)


def test_a_fast_recording_is_reduced() -> None:
    count = 8000
    t = np.arange(count) * 1e-4
    ones = np.ones(count, dtype=bool)
    fast = Signals(1e-4, np.sin(t), np.cos(t), None, ones, ones, (0, 3005), (0.5, 2.0))
    slow = reduce_rate(fast)
    assert slow.period_s == pytest.approx(1e-3) and len(slow) == 300 + 499
    assert slow.stretch_begins == (0, 300) and slow.begin_s == (0.5, 2.0)
    assert np.array_equal(slow.cart[:300], fast.cart[:3000:10])
    assert slow.command[5] == pytest.approx(np.mean(fast.command[50:60]))
    assert reduce_rate(slow) is slow
