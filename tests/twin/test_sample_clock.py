"""Sampling times are even, whoever asks for them, and how late."""

import math

import pytest

from pendulum_twin.sample_clock import SampleClock

MS = 1_000_000  # ns


def test_a_jittering_timer_gives_even_times() -> None:
    clock = SampleClock(0.01)
    asked_ms = [0, 10.4, 19.8, 34.0, 34.1, 50.3]
    given_ms = [t // MS for now in asked_ms for t in clock.take_due_times(round(now * MS))]
    assert given_ms == [0, 10, 20, 30, 40, 50]


def test_a_standstill_is_given_up_and_counted() -> None:
    clock = SampleClock(0.01)
    assert clock.take_due_times(0) == [0]
    assert clock.take_due_times(2000 * MS) == [2000 * MS]
    assert clock.lost == 199
    assert clock.take_due_times(2010 * MS) == [2010 * MS]


def test_times_stay_whole_periods_apart_over_a_standstill() -> None:
    """A timer that fires every period goes on in its phase, too."""
    clock = SampleClock(0.01)
    clock.take_due_times(0)
    assert clock.take_due_times(2004 * MS) == [2000 * MS] and clock.lost == 199
    assert clock.take_due_times(3007 * MS) == [3010 * MS] and clock.lost == 299
    assert clock.take_due_times(3020 * MS) == [3020 * MS]


def test_a_clock_set_back_starts_anew() -> None:
    clock = SampleClock(0.01)
    clock.take_due_times(5000 * MS)
    assert clock.take_due_times(1000 * MS) == [1000 * MS]
    assert clock.take_due_times(1010 * MS) == [1010 * MS]


def test_no_drift_over_an_hour() -> None:
    clock = SampleClock(1 / 300)
    times = [t for k in range(3000) for t in clock.take_due_times(round(k * 1e9 / 300))]
    assert times[-1] == pytest.approx(2999 / 300 * 1e9, abs=1) and len(times) == 3000


def test_a_time_is_due_from_half_a_period_before_it() -> None:
    clock = SampleClock(0.01)
    assert clock.take_due_times(0) == [0]
    assert clock.take_due_times(4 * MS) == []
    assert clock.take_due_times(6 * MS) == [10 * MS]
    assert clock.take_due_times(10 * MS) == []


def test_a_short_standstill_is_made_up_for() -> None:
    clock = SampleClock(0.01)
    clock.take_due_times(0)
    assert clock.take_due_times(200 * MS) == [k * 10 * MS for k in range(1, 21)]
    assert clock.lost == 0


@pytest.mark.parametrize("rate_hz", [0.5, 1.0, 2.0, 3.0, 3.9])
def test_a_slow_clock_gives_even_times(rate_hz: float) -> None:
    """A sample that is due is no backlog, however long the period is."""
    clock, period_ms = SampleClock(1 / rate_hz), 1e3 / rate_hz
    asked_ms = [
        (k + late) * period_ms
        for k in range(1, 20)
        for late in (0.2 * math.sin(k), 0.3)  # who asks again gets nothing twice
    ]
    given_ms = [t / MS for now in (0.0, *asked_ms) for t in clock.take_due_times(round(now * MS))]
    assert given_ms == pytest.approx([k * period_ms for k in range(20)], abs=1e-5)
    assert clock.lost == 0


def test_a_slow_clock_gives_up_what_it_missed_and_begins_anew_when_set_back() -> None:
    clock = SampleClock(0.5)
    clock.take_due_times(0)
    assert clock.take_due_times(1100 * MS) == [1000 * MS] and clock.lost == 1
    assert clock.take_due_times(500 * MS) == [500 * MS]
