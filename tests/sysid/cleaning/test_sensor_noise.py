"""The noise of a sensor is measured, not how the motion bends where the command steps."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm, solve_discrete_are

from pendulum_sysid.cleaning.sensor_noise import measure_noise
from pendulum_sysid.cleaning.smooth_state import smooth_state
from pendulum_twin.arrays import Floats
from pendulum_twin.signals import Signals

SECONDS, DEVIATION = 60.0, 1e-4  # s; m


def push_cart(period_s: float, late_s: float = 0.0) -> tuple[Floats, Floats]:
    """Return a command that steps every 0.4 s, and where it takes a cart with viscous friction.

    late_s: s, by which the cart follows the command later.
    """
    fine, step_s = int(SECONDS / 1e-3), 1e-3
    levels = np.random.default_rng(5).uniform(-0.5, 0.5, int(SECONDS / 0.4) + 1)
    times = step_s * np.arange(fine)
    sample = np.floor((times - late_s) / period_s + 1e-9) * period_s
    pushes = levels[np.clip(np.floor(sample / 0.4 + 1e-9).astype(int), 0, None)]
    x = v = 0.0
    places = np.empty(fine)
    for k, push in enumerate(pushes):
        places[k] = x
        v += step_s * (15.0 * push - 2.0 * v - 3.0 * x)
        x += step_s * v
    every = np.arange(0, fine, round(period_s / step_s))
    begins = period_s * np.arange(len(every))
    return levels[np.floor(begins / 0.4 + 1e-9).astype(int)], places[every]


def record(period_s: float, noise: Floats | float, late_s: float = 0.0) -> Signals:
    command, cart = push_cart(period_s, late_s)
    every = np.ones(len(cart), dtype=bool)
    return Signals(period_s, command, cart + noise, None, every, every)


@pytest.mark.parametrize(("period_s", "late_s"), [(0.01, 0.0), (0.02, 0.0), (0.02, 0.02)])
def test_steps_of_the_command_are_no_noise(period_s: float, late_s: float) -> None:
    noise = np.random.default_rng(6).normal(0.0, DEVIATION, int(SECONDS / period_s))
    signals = record(period_s, noise, late_s)
    assert signals.cart is not None
    measured = measure_noise(signals.cart, signals.cart_valid, signals)
    assert measured == pytest.approx(DEVIATION, rel=0.1)


def test_at_25_hz_the_noise_is_no_more_than_twice_too_large() -> None:
    """Bends of the motion that no step of the command explains are left."""
    noise = np.random.default_rng(6).normal(0.0, DEVIATION, int(SECONDS / 0.04))
    signals = record(0.04, noise)
    assert signals.cart is not None
    assert DEVIATION < measure_noise(signals.cart, signals.cart_valid, signals) < 2 * DEVIATION


@pytest.mark.parametrize("period_s", [0.01, 0.02])
def test_noise_that_a_controller_feeds_back_counts_as_noise(period_s: float) -> None:
    """Balancing, the command holds the angle's noise, and so would explain it over short times."""
    motion = np.array([[0.0, 0, 1, 0], [0, 0, 0, 1], [0, -1.0, -3.0, 0], [0, 40.0, 6.0, -0.2]])
    push = np.array([[0.0], [0.0], [15.0], [-30.0]])
    whole = np.block([[motion, push], [np.zeros((1, 5))]])
    step = expm(period_s * whole)
    moved, pushed = step[:4, :4], step[:4, 4:]
    weights = np.diag([10.0, 10.0, 0.1, 0.1]), np.array([[10.0]])
    ahead = solve_discrete_are(moved, pushed, *weights)
    gains = np.linalg.solve(weights[1] + pushed.T @ ahead @ pushed, pushed.T @ ahead @ moved)[0]
    random, state, before = np.random.default_rng(8), np.zeros(4), np.zeros(2)
    command, read = np.empty(3000), np.empty((3000, 2))
    for k in range(3000):
        read[k] = state[:2] + random.normal(0.0, [DEVIATION, 10 * DEVIATION])
        command[k] = -gains @ np.concatenate([read[k], (read[k] - before) / period_s])
        before = read[k]
        state = moved @ state + pushed[:, 0] * command[k]
    every = np.ones(3000, dtype=bool)
    signals = Signals(period_s, command, read[:, 0], read[:, 1], every, every)
    for values, deviation in zip(read.T, (DEVIATION, 10 * DEVIATION), strict=True):
        assert measure_noise(values, every, signals) == pytest.approx(deviation, rel=0.12)


def test_bends_of_interpolated_samples_count_as_noise() -> None:
    signals = record(0.02, 0.0)
    taken, between = (
        measure_noise(np.array(s.cart), s.cart_valid, s)
        for s in (signals, replace(signals, interpolated=True))
    )
    assert between > 2 * taken


def test_recordings_whose_zeros_lie_apart_by_a_part_of_a_step_have_one_step() -> None:
    step = 1.5e-3
    slow = 0.02 * np.sin(0.5 * 0.01 * np.arange(1000))
    values = np.concatenate([step * np.round(slow / step) + 0.3 * k * step for k in range(4)])
    every = np.ones(len(values), dtype=bool)
    begins = (0, 1000, 2000, 3000)
    signals = Signals(0.01, np.zeros(len(values)), values, None, every, every, begins)
    assert measure_noise(values, every, signals) == pytest.approx(step / np.sqrt(12), rel=0.1)


def test_without_a_step_of_the_command_bends_are_taken_for_noise() -> None:
    """The command is what tells the two apart: without it the same motion seems noisy."""
    signals = record(0.04, 0.0)
    assert signals.cart is not None
    still = Signals(
        0.04, np.zeros(len(signals)), signals.cart, None, signals.cart_valid, signals.pole_valid
    )
    blind, seeing = (measure_noise(signals.cart, signals.cart_valid, s) for s in (still, signals))
    assert seeing < 0.2 * blind


@pytest.mark.parametrize("step", [57e-6, 1.5e-3])
def test_an_encoder_s_rounding_is_measured_where_the_joint_never_rests(step: float) -> None:
    """Neighbouring samples are many steps apart, all samples together lie a step apart."""
    t = 0.01 * np.arange(6000)
    values = np.round(0.9 * (np.sin(4.4 * t) + 0.25 * np.sin(12 * t + 0.3)) / step) * step
    every = np.ones(len(t), dtype=bool)
    signals = Signals(0.01, np.zeros(len(t)), values, None, every, every)
    assert measure_noise(values, every, signals) == pytest.approx(step / np.sqrt(12), rel=0.1)


def test_an_encoder_s_rounding_is_measured_over_several_turns() -> None:
    """A slow pole is read alike from sample to sample, which is no small scatter."""
    step = 2.0 * np.pi / 4096
    slow = 0.02 * np.sin(0.5 * 0.01 * np.arange(1000))
    turn, read = 2.0 * np.pi, step * np.round(slow / step)
    turns = np.concatenate([(turn * k + read) - turn * k for k in range(4)])  # counted back
    every = np.ones(len(turns), dtype=bool)
    signals = Signals(0.01, np.zeros(len(turns)), None, turns, every, every, (0, 1000, 2000, 3000))
    assert measure_noise(turns, every, signals) == pytest.approx(step / np.sqrt(12), rel=0.1)


def test_placeholders_say_nothing_of_the_noise() -> None:
    noise = np.random.default_rng(6).normal(0.0, DEVIATION, 6000)
    signals = record(0.01, noise)
    spikes = np.arange(50, 6000, 100)
    cart, valid = np.array(signals.cart), np.ones(6000, dtype=bool)
    cart[spikes] += 1e-3
    valid[spikes] = False
    spoilt = Signals(0.01, signals.command, cart, None, valid, valid)
    assert measure_noise(cart, valid, spoilt) == pytest.approx(DEVIATION, rel=0.35)


@pytest.mark.parametrize("length", [1, 2, 5, 9, 30])
def test_a_short_recording_has_a_finite_noise(length: int) -> None:
    every = np.ones(length, dtype=bool)
    values = 1.0 + 0.02 * np.arange(length)
    signals = Signals(0.01, np.arange(length) % 3, values, values, every, every)
    noise = smooth_state(signals).noise
    assert noise.cart_m is not None and noise.pole_rad is not None
    assert np.isfinite([noise.cart_m, noise.pole_rad]).all() and noise.cart_m > 0.0
