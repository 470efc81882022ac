"""Steps that no motion makes: spikes, which return, and jumps, which stay."""

import numpy as np
import pytest

from pendulum_sysid.cleaning.clock import Rate
from pendulum_sysid.cleaning.jumps import find_jumps, measure_step_floor, take_shortest_way
from pendulum_sysid.cleaning.wraps import TURN

RATE = Rate(0.01, 0.0)
STAMPS = np.arange(1500) * RATE.period_s
MOTION = 0.3 * np.sin(4.0 * STAMPS)


@pytest.mark.parametrize("width", [1, 2, 3, 5])
@pytest.mark.parametrize("size", [-0.2, 0.2])
def test_a_spike_is_found_where_it_is(width: int, size: float) -> None:
    values = MOTION.copy()
    values[700 : 700 + width] += size
    jumps = find_jumps(STAMPS, values, RATE)
    assert np.flatnonzero(~jumps.good).tolist() == list(range(700, 700 + width))
    assert not len(jumps.stays)


def test_a_jump_that_stays_is_no_spike() -> None:
    jumps = find_jumps(STAMPS, np.where(STAMPS < 7.0, MOTION, MOTION + 0.2), RATE)
    assert jumps.good.all()
    assert jumps.stays.tolist() == [699]


def test_a_kink_of_the_motion_is_neither() -> None:
    jumps = find_jumps(STAMPS, 0.3 * np.abs(np.sin(2.0 * STAMPS)), RATE)
    assert jumps.good.all() and not len(jumps.stays)


def test_many_spikes_do_not_hide_one_another() -> None:
    values, places = MOTION.copy(), np.arange(100, 1400, 12)
    values[places] += 0.15
    assert np.flatnonzero(~find_jumps(STAMPS, values, RATE).good).tolist() == places.tolist()


def test_too_few_samples_are_not_judged() -> None:
    jumps = find_jumps(STAMPS[:10], np.where(STAMPS[:10] < 0.05, 0.0, 1.0), RATE)
    assert jumps.good.all() and not len(jumps.stays)


def test_whole_turns_are_no_steps() -> None:
    assert np.allclose(take_shortest_way(np.array([0.1, TURN + 0.1]), TURN), 0.1)
    assert np.array_equal(take_shortest_way(np.array([0.1, 7.0]), None), [0.1, 7.0])


@pytest.mark.parametrize("noise", [1e-4, 1e-3])
def test_the_floor_rises_with_the_noise(noise: float) -> None:
    values = MOTION + np.random.default_rng(1).normal(0.0, noise, len(MOTION))
    assert 10.0 * noise < measure_step_floor(values) < 40.0 * noise
