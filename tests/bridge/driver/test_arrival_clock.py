"""Simulated arrivals, whose true sampling times are known: how far off are the clock's?"""

from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pendulum_bridge.driver.arrival_clock import ArrivalClock, Timing

START_NS = 1_700_000_000_000_000_000
MS = 1e6


@dataclass(frozen=True)
class Run:
    """Sampling times and arrivals (ns since START_NS) of packets, and how many never came."""

    sampled: np.ndarray
    arrived: np.ndarray
    lost: int = 0

    def stamp_arrivals(self, rate_hz: float = 100.0) -> tuple[np.ndarray, Timing]:
        """Return the clock's times, ns since START_NS, and what it says of them."""
        clock = ArrivalClock(rate_hz)
        stamps = [clock.stamp(START_NS + int(arrival)) - START_NS for arrival in self.arrived]
        return np.array(stamps), clock.timing


def simulate(
    seed: int,
    count: int = 6000,
    period_ms: float = 10.0,
    jitter_ms: float = 0.2,
    outliers: float = 0.0,
    lost: float = 0.0,
    standstills: int = 0,
) -> Run:
    """Return packets sent evenly and delayed; none overtakes another.

    jitter_ms: mean of an exponential delay. outliers: share delayed by 5-20 ms more. standstills:
    so many times all is held up for 15-300 ms and then comes in a burst.
    """
    random = np.random.default_rng(seed)
    sampled = np.arange(count) * period_ms * MS
    late = random.random(count) < outliers
    arrived = sampled + MS * (
        random.exponential(jitter_ms, count) + late * random.uniform(5, 20, count)
    )
    for begin in random.integers(100, count - 100, standstills):
        end = sampled[begin] + random.uniform(15, 300) * MS
        is_held = (arrived >= sampled[begin]) & (arrived < end)
        arrived[is_held] = end + 0.4 * MS * np.arange(is_held.sum())
    came = random.random(count) >= lost
    return Run(sampled[came], np.maximum.accumulate(arrived)[came], int(count - came.sum()))


def off_ms(estimates: np.ndarray, run: Run, skipped: int = 50) -> np.ndarray:
    return np.abs(estimates - run.sampled)[skipped:] / MS


def quantiles(errors: np.ndarray) -> list[float]:
    return [*np.percentile(errors, [50, 99]), errors.max()]


@pytest.mark.parametrize(
    ("name", "most_ms", "options"),
    [  # most_ms: p50, p99 and maximum of how far the clock's times are off
        ("jitter of 0.2 ms", (0.08, 0.15, 0.3), {}),
        ("5 % lost", (0.08, 0.15, 0.5), {"lost": 0.05}),
        ("1 % outliers, 5 % lost", (0.08, 0.3, 25.0), {"outliers": 0.01, "lost": 0.05}),
        (
            "and 20 standstills",
            (0.08, 15.0, 65.0),
            {"outliers": 0.01, "lost": 0.05, "standstills": 20},
        ),
        ("rate 5 % low", (0.08, 0.3, 25.0), {"outliers": 0.01, "lost": 0.05, "period_ms": 10.5}),
        (
            "rate 5 % high",
            (0.08, 0.3, 25.0),
            {"outliers": 0.01, "lost": 0.05, "period_ms": 10 / 1.05},
        ),
    ],
)
def test_times_are_far_nearer_than_arrivals(
    name: str, most_ms: tuple[float, ...], options: dict
) -> None:
    runs = [simulate(seed, **options) for seed in range(4)]
    estimates = [run.stamp_arrivals() for run in runs]
    errors = quantiles(
        np.concatenate(
            [off_ms(stamps, run) for (stamps, _), run in zip(estimates, runs, strict=True)]
        )
    )
    arrivals = quantiles(np.concatenate([off_ms(run.arrived, run) for run in runs]))
    print(
        f"{name:24s} p50, p99, max [ms]: times {np.round(errors, 3)}, arrivals "
        f"{np.round(arrivals, 3)}"
    )
    assert np.all(np.array(errors) < most_ms)
    for (stamps, timing), run in zip(estimates, runs, strict=True):
        assert np.diff(stamps).min() > 0
        assert 1e3 * timing.period_s == pytest.approx(options.get("period_ms", 10.0), rel=1e-4)
        assert timing.lost == pytest.approx(run.lost, abs=3) and (
            timing.begun,
            timing.set_back,
        ) == (0, 0)


@pytest.mark.parametrize("period_ms", [9.5, 10.0, 10.5])
def test_the_grid_is_found_whatever_the_first_packets_are(period_ms: float) -> None:
    for seed in range(60):
        run = simulate(seed, 400, period_ms, outliers=0.05, lost=0.1)
        stamps, timing = run.stamp_arrivals()
        assert np.percentile(off_ms(stamps, run), 80) < 1.2, f"seed {seed}"
        assert timing.lost == pytest.approx(run.lost, abs=2)
        assert 1e3 * timing.period_s == pytest.approx(period_ms, rel=1e-2)


def test_steps_are_even_to_a_fraction_of_the_jitter() -> None:
    run = simulate(1)
    stamps, _ = run.stamp_arrivals()
    assert np.std(np.diff(run.arrived)[500:]) > 0.2 * MS
    assert np.std(np.diff(stamps)[500:]) < 0.01 * MS


def test_lost_samples_leave_whole_periods_out() -> None:
    sampled = (
        np.concatenate([np.arange(300), np.arange(301, 400), np.arange(403, 500)]) * 10.0 * MS
    )
    stamps, timing = Run(sampled, sampled).stamp_arrivals()
    assert np.array_equal(stamps, sampled) and timing.lost == 4


def test_where_nothing_is_lost_lateness_by_whole_periods_is_a_standstill() -> None:
    sampled = np.arange(500) * 10.0 * MS
    arrived = sampled.copy()
    arrived[200:203] = sampled[202]  # the first is late by two periods
    clock = ArrivalClock(100.0, most_lost=0)
    stamps = np.array(
        [clock.stamp(START_NS + int(arrival_ns)) - START_NS for arrival_ns in arrived]
    )
    assert np.array_equal(stamps, sampled) and clock.timing.lost == 0


def test_a_burst_after_a_standstill_is_a_period_apart() -> None:
    sampled = np.arange(500) * 10.0 * MS
    arrived = sampled.copy()
    arrived[200:212] = sampled[212] - 5 * MS + 0.01 * MS * np.arange(12)
    stamps, timing = Run(sampled, arrived).stamp_arrivals()
    assert np.abs(stamps - sampled).max() < 0.01 * MS and timing.lost == 0


@pytest.mark.parametrize(("change", "settled"), [(0.01, 300), (-0.03, 300), (0.001, 300)])
def test_another_rate_is_followed(change: float, settled: int) -> None:
    steps = np.where(np.arange(1500) < 600, 1.0, 1 + change) * 10.0 * MS
    sampled = np.cumsum(steps)
    run = Run(sampled, sampled + np.random.default_rng(0).exponential(0.2 * MS, len(sampled)))
    errors = off_ms(run.stamp_arrivals()[0], run)
    assert errors.max() < 2.5 and errors[550 + settled :].max() < 0.8


@pytest.mark.parametrize(
    ("step_s", "within", "timing"),
    # within how many samples the times are right again; timing: lost, new grids, of these set back
    [
        (0.05, 3, (5, 0, 0)),  # nobody can tell it from 5 lost samples
        (0.9, 3, (90, 0, 0)),
        (5.0, 0, (0, 1, 0)),
        (86400.0, 0, (0, 1, 0)),
        (-0.05, 8, (0, 0, 0)),
        (-0.9, 130, (0, 0, 0)),
        (-5.0, 0, (0, 1, 1)),
        (-86400.0, 0, (0, 1, 1)),
    ],
)
def test_a_clock_that_is_set_is_followed(
    step_s: float, within: int, timing: tuple[int, ...]
) -> None:
    sampled = np.arange(1500) * 10.0 * MS
    sampled[600:] += step_s * 1e9
    run = Run(sampled, sampled + np.random.default_rng(0).exponential(0.2 * MS, len(sampled)))
    stamps, estimates = run.stamp_arrivals()
    errors = off_ms(stamps, run)
    assert max(errors[:550].max(), errors[550 + within :].max()) < 1.0
    assert (estimates.lost, estimates.begun, estimates.set_back) == timing
    assert (
        np.count_nonzero(np.diff(stamps) <= 0) == estimates.set_back
    )  # only then they go back, and only once


def test_a_long_gap_begins_anew() -> None:
    sampled = np.concatenate([np.arange(300), np.arange(800, 1000)]) * 10.0 * MS + 0.3 * MS
    stamps, timing = Run(sampled, sampled).stamp_arrivals()
    assert np.array_equal(stamps, sampled) and timing == Timing(pytest.approx(0.01), begun=1)


def test_a_first_packet_that_was_held_up_is_soon_forgotten() -> None:
    for held_ms in (2.0, 7.0, 18.0, 200.0):
        sampled = np.arange(300) * 10.0 * MS
        arrived = np.maximum.accumulate(np.concatenate([[held_ms * MS], sampled[1:]]))
        stamps, _ = Run(sampled, arrived).stamp_arrivals()
        assert off_ms(stamps, Run(sampled, arrived), skipped=100).max() < 0.3


def test_before_anything_was_measured_the_period_is_the_nominal_one() -> None:
    assert ArrivalClock(50.0).timing == Timing(0.02)


@given(
    steps_ms=st.lists(st.floats(-3000, 3000) | st.floats(0, 30), max_size=60),
    rate_hz=st.sampled_from([10.0, 100.0, 1000.0]),
)
def test_whatever_comes_times_rise_unless_the_clock_was_set_back(
    steps_ms: list[float], rate_hz: float
) -> None:
    clock = ArrivalClock(rate_hz)
    arrival = START_NS
    last = clock.stamp(arrival)
    for step in steps_ms:
        arrival += int(step * MS)
        before = clock.timing.set_back
        stamp = clock.stamp(arrival)
        assert stamp > last or clock.timing.set_back == before + 1
        assert stamp - last >= 0.22e9 / rate_hz or clock.timing.begun
        last = stamp
        assert clock.timing.lost >= 0
