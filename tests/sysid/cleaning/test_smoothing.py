"""Smoothing: exact where it can be, honest about noise, and never across a break."""

import numpy as np
import pytest
from scipy.signal import savgol_filter

from pendulum_sysid.cleaning.smooth_state import smooth_state
from pendulum_sysid.cleaning.smoothing import (
    DEGREE,
    HALF_LENGTHS,
    compute_noise_gain,
    differentiate,
    smooth,
)
from pendulum_twin.arrays import Floats
from pendulum_twin.signals import Signals

PERIOD_S, N = 0.01, 2000
T = PERIOD_S * np.arange(N)
EVERY = np.ones(N, dtype=bool)
WHOLE = (slice(0, N),)


def motion(size: float) -> Floats:
    return size * (np.sin(4.4 * T) + 0.25 * np.sin(12 * T + 0.3))


@pytest.mark.parametrize("order", range(DEGREE + 1))
def test_a_polynomial_comes_back_with_its_rates(order: int) -> None:
    p = np.polynomial.Polynomial(
        np.random.default_rng(order).normal(size=order + 1), domain=[0.0, 20.0]
    )
    smoothed = smooth(p(T), EVERY, WHOLE, PERIOD_S)
    assert np.allclose(smoothed.value, p(T), rtol=0, atol=1e-11)
    assert np.allclose(smoothed.rate, p.deriv()(T), rtol=0, atol=1e-10)
    assert np.allclose(
        differentiate(p(T), WHOLE, PERIOD_S, 10, 2), p.deriv(2)(T), rtol=0, atol=1e-7
    )


@pytest.mark.parametrize("deviation", [1e-4, 1e-3, 1e-2])
def test_the_deviations_of_smoothed_values_are_those_of_their_errors(deviation: float) -> None:
    noise = np.random.default_rng(1).normal(0.0, deviation, N)
    smoothed = smooth(motion(0.2) + noise, EVERY, WHOLE, PERIOD_S)
    assert np.std(smoothed.value - motion(0.2)) == pytest.approx(smoothed.value_noise, rel=0.5)


def test_nothing_is_smoothed_across_a_break() -> None:
    middle = N // 2
    values = motion(0.2)
    values[middle:] += 5.0
    stretches = (slice(0, middle), slice(middle, N))
    smoothed = smooth(values, EVERY, stretches, PERIOD_S)
    alone = smooth(values[:middle], EVERY[:middle], (slice(0, middle),), PERIOD_S)
    assert np.abs(smoothed.value - values).max() < 1e-6
    assert np.allclose(smoothed.rate[:middle], alone.rate, rtol=0, atol=1e-9)
    unbroken = smooth(values, EVERY, WHOLE, PERIOD_S)
    assert np.abs(unbroken.value - values).max() > 0.5


@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize("lengths", [(2000,), (21, 22, 300, 1657)])
def test_every_stretch_is_smoothed_as_scipy_does(lengths: tuple[int, ...], order: int) -> None:
    values = motion(0.2) + np.random.default_rng(4).normal(0.0, 1e-3, N)
    ends = np.cumsum(lengths)
    stretches = tuple(slice(b - n, b) for b, n in zip(ends.tolist(), lengths, strict=True))
    expected = np.concatenate(
        [savgol_filter(values[s], 21, DEGREE, order, PERIOD_S) for s in stretches]
    )
    smoothed = differentiate(values, stretches, PERIOD_S, 10, order)
    assert np.allclose(smoothed, expected, rtol=1e-9, atol=1e-9)


def test_rougher_motion_is_smoothed_over_shorter_lengths() -> None:
    """The length follows from the data: less noise is left where the motion is slow."""
    noise = np.random.default_rng(2).normal(0.0, 1e-3, N)
    slow, fast = (smooth(np.sin(rate * T) + noise, EVERY, WHOLE, PERIOD_S) for rate in (1.0, 30.0))
    assert slow.value_noise < 0.6 * fast.value_noise


@pytest.mark.parametrize("length", [1, 2, 5, 8, 2 * HALF_LENGTHS[0] + 2])
def test_a_short_stretch_is_smoothed_as_far_as_it_reaches(length: int) -> None:
    values = 1.0 + 2.0 * T[:length]
    smoothed = smooth(values, EVERY[:length], (slice(0, length),), PERIOD_S)
    assert np.allclose(smoothed.value, values, rtol=0, atol=1e-9)
    assert np.all(
        np.isfinite([smoothed.rate, differentiate(values, (slice(0, length),), PERIOD_S, 10, 2)])
    ) and np.isfinite(smoothed.value_noise)


def test_placeholders_say_nothing_of_the_noise() -> None:
    values = motion(0.2) + np.random.default_rng(3).normal(0.0, 1e-3, N)
    spikes = np.arange(50, N, 100)
    valid = EVERY.copy()
    valid[spikes] = False
    spoilt = values.copy()
    spoilt[spikes] += 0.002
    smoothed = smooth(spoilt, valid, WHOLE, PERIOD_S)
    gain = compute_noise_gain(smoothed.half_length, PERIOD_S, 0)
    assert smoothed.value_noise == pytest.approx(1e-3 * gain, rel=0.2)


def test_a_joint_that_is_not_there_stays_at_zero() -> None:
    smoothed = smooth_state(
        Signals(PERIOD_S, np.zeros(N), None, motion(1.0) + np.pi, EVERY, EVERY)
    )
    assert smoothed.noise.cart_m is None and smoothed.noise.pole_rad is not None
    assert not np.any(smoothed.states[:, [0, 2]]) and np.any(smoothed.states[:, 3])


def test_a_long_stretch_that_counts_nowhere_decides_nothing() -> None:
    begins = np.arange(0, 2000, 100)
    short = tuple(slice(int(b), int(b) + 100) for b in begins)
    values = motion(0.2) + np.random.default_rng(3).normal(0.0, 1e-3, N)
    alone = smooth(values, EVERY, short, PERIOD_S)
    more = np.concatenate([values, np.zeros(300)])
    valid = np.concatenate([EVERY, np.zeros(300, dtype=bool)])
    beside = smooth(more, valid, (*short, slice(N, N + 300)), PERIOD_S)
    assert (beside.half_length, beside.value_noise) == (alone.half_length, alone.value_noise)
