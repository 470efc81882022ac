"""Reported velocities far above what the positions did nearby are out of line."""

import numpy as np
import pytest

from pendulum_sysid.cleaning.velocity_spikes import find_impossible_rates

PERIOD_S = 0.01
STAMPS = np.arange(1000) * PERIOD_S
POSITION, VELOCITY = 0.2 * np.sin(3.0 * STAMPS), 0.6 * np.cos(3.0 * STAMPS)


@pytest.mark.parametrize("size", [-8.0, 8.0])
def test_a_velocity_spike_is_found_where_it_is(size: float) -> None:
    reported = VELOCITY.copy()
    reported[[300, 700]] += size
    bad = find_impossible_rates(STAMPS, reported, STAMPS, POSITION, PERIOD_S)
    assert np.flatnonzero(bad).tolist() == [300, 700]


@pytest.mark.parametrize("late", [0, 3, 6])
def test_a_velocity_that_lags_is_no_spike(late: int) -> None:
    bad = find_impossible_rates(STAMPS, np.roll(VELOCITY, late), STAMPS, POSITION, PERIOD_S)
    assert not bad.any()


def test_one_position_rules_nothing_out() -> None:
    assert not find_impossible_rates(STAMPS, VELOCITY, STAMPS[:1], POSITION[:1], PERIOD_S).any()
