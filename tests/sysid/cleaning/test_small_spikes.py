"""Spikes that are small beside the motion stand out from a cubic through their neighbours."""

import numpy as np
import pytest

from pendulum_sysid.cleaning.small_spikes import find_small_spikes

PERIOD_S = 0.01
STAMPS = np.arange(1500) * PERIOD_S
MOTION = 0.3 * np.sin(4.0 * STAMPS)


@pytest.mark.parametrize("width", [1, 2])
def test_a_small_spike_is_found_where_it_is(width: int) -> None:
    values = MOTION.copy()
    values[700 : 700 + width] += 0.01
    ((first, stop),) = find_small_spikes(STAMPS, values, PERIOD_S)
    assert 699 <= first <= 700 and 700 + width <= stop <= 701 + width


def test_noise_is_no_spike() -> None:
    values = MOTION + np.random.default_rng(1).normal(0.0, 1e-3, len(MOTION))
    assert find_small_spikes(STAMPS, values, PERIOD_S) == ()


def test_a_kink_is_no_spike() -> None:
    assert find_small_spikes(STAMPS, 0.3 * np.abs(np.sin(2.0 * STAMPS)), PERIOD_S) == ()


def test_a_spike_beside_a_gap_is_left_alone() -> None:
    """The cubic holds on an even clock alone: across a lost second it says nothing."""
    stamps = np.where(STAMPS < 7.02, STAMPS, STAMPS + 1.0)
    values = MOTION.copy()
    values[700] += 0.01
    assert find_small_spikes(stamps, values, PERIOD_S) == ()


def test_a_few_samples_hold_no_window() -> None:
    assert find_small_spikes(STAMPS[:8], MOTION[:8], PERIOD_S) == ()
