"""The clock: rate, grid, samples put on it, and commands held over each period."""

import numpy as np
import pytest

from pendulum_sysid.cleaning.clock import (
    Rate,
    estimate_rate,
    fill,
    find_runs,
    hold_commands,
    make_grid,
    resample,
)

PERIOD_S = 0.01
RATE = Rate(PERIOD_S, 0.0)
GRID = np.arange(400) * PERIOD_S


@pytest.mark.parametrize("period_s", [0.001, 0.01, 0.032])
def test_the_period_is_measured_beside_gaps_and_jitter(period_s: float) -> None:
    random = np.random.default_rng(1)
    numbers = np.delete(np.arange(2000), random.choice(np.arange(1, 1999), 40, replace=False))
    rate = estimate_rate(period_s * (numbers + random.normal(0.0, 0.05, len(numbers))))
    assert rate.period_s == pytest.approx(period_s, rel=1e-4)
    assert rate.jitter == pytest.approx(0.05, rel=0.1)


def test_even_stamps_have_no_jitter() -> None:
    rate = estimate_rate(GRID)
    assert (rate.period_s, rate.jitter) == (pytest.approx(PERIOD_S, rel=1e-9), pytest.approx(0.0))


def test_the_grid_runs_through_most_stamps_and_over_lost_ones() -> None:
    stamps = np.delete(3.0 + GRID, [50, 51, 200])
    assert np.allclose(make_grid(stamps, PERIOD_S), 3.0 + GRID, rtol=0, atol=1e-9)


def test_jittering_stamps_get_an_even_grid() -> None:
    stamps = GRID + np.random.default_rng(2).normal(0.0, 1e-3, len(GRID))
    grid = make_grid(stamps, PERIOD_S)
    assert np.allclose(np.diff(grid), PERIOD_S, rtol=0, atol=1e-12)
    assert np.abs(grid[:-1] - GRID[: len(grid) - 1]).max() < PERIOD_S


def test_a_sample_on_its_instant_keeps_its_value_and_a_lost_one_is_filled() -> None:
    values = np.sin(5.0 * GRID)
    kept = np.delete(np.arange(len(GRID)), [100, 101])
    resampled, valid = resample(GRID, GRID[kept], values[kept], RATE)
    assert np.array_equal(resampled[kept], values[kept])
    assert np.array_equal(np.flatnonzero(~valid), [100, 101])
    assert np.allclose(resampled, values, rtol=0, atol=1e-4)


def test_one_sample_says_nothing() -> None:
    _, valid = resample(GRID, GRID[:1], GRID[:1], RATE)
    assert not valid.any()


def test_a_fill_is_a_cubic_within_and_a_line_at_the_ends() -> None:
    cubic = 1.0 + GRID - 0.5 * GRID**2 + 0.1 * GRID**3
    valid = np.ones(len(GRID), dtype=bool)
    valid[[40, 41, 42]] = False
    spoilt = np.where(valid, cubic, 99.0)
    assert np.allclose(fill(spoilt, valid), cubic, rtol=0, atol=1e-9)
    line = 2.0 - 3.0 * GRID
    ends = np.ones(len(GRID), dtype=bool)
    ends[[0, 1, -1]] = False
    assert np.allclose(fill(np.where(ends, line, 99.0), ends), line, rtol=0, atol=1e-9)


def test_runs_are_found_at_both_ends() -> None:
    mask = np.array([True, False, True, True, False, True])
    assert find_runs(mask) == [(0, 1), (2, 4), (5, 6)]


def test_a_command_is_zero_before_the_first_message_and_held_after_the_last() -> None:
    command = hold_commands(GRID, PERIOD_S, np.array([1.0, 2.0]), np.array([0.3, -0.2]))
    assert np.all(command[:100] == 0.0)
    assert np.allclose(command[100:200], 0.3) and np.allclose(command[200:], -0.2)


def test_a_command_between_samples_counts_for_its_share_of_the_period() -> None:
    stamps = GRID + 0.5 * PERIOD_S
    command = hold_commands(GRID, PERIOD_S, stamps, np.where(GRID < 1.995, 0.0, 1.0))
    assert np.allclose(command[:200], 0.0) and np.allclose(command[201:], 1.0)
    assert command[200] == pytest.approx(0.5)


def test_no_commands_are_zero() -> None:
    assert not np.any(hold_commands(GRID, PERIOD_S, np.empty(0), np.empty(0)))
