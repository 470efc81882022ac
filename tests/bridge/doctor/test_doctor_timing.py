"""Rate, jitter and losses from arrivals alone."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pendulum_bridge.doctor.faults import Fault
from pendulum_bridge.doctor.timing import (
    check_jitter,
    check_losses,
    check_rate,
    measure_period,
    number_samples,
)


def arrivals(
    rate_hz: float = 100.0, count: int = 300, jitter: float = 0.0, seed: int = 0
) -> np.ndarray:
    """Return arrivals that are late by up to a share of the period."""
    late = np.random.default_rng(seed).uniform(0, jitter, count)
    return 5.0 + (np.arange(count) + late) / rate_hz


def faults_of(times: np.ndarray, rate_hz: float = 100.0) -> set[Fault | None]:
    period_s = measure_period(times, 1 / rate_hz)
    return {
        check_rate(times, rate_hz).fault,
        check_jitter(times, period_s).fault,
        check_losses(times, period_s).fault,
    } - {None}


def burst(times: np.ndarray, together: int) -> np.ndarray:
    """Return arrivals of which each waits for the last of so many."""
    groups = np.minimum((np.arange(len(times)) // together + 1) * together - 1, len(times) - 1)
    return times[groups] + 1e-5 * (np.arange(len(times)) % together)


@pytest.mark.parametrize(
    ("times", "faults"),
    [
        (arrivals(), set()),
        (arrivals(jitter=0.3), set()),
        (arrivals(99.5), set()),
        (arrivals(95.0), {Fault.RATE_OFF}),
        (arrivals(50.0), {Fault.RATE_WRONG}),
        (arrivals(200.0), {Fault.RATE_WRONG}),
        (arrivals(100.0, jitter=0.95), {Fault.JITTER}),
        (burst(arrivals(), 4), {Fault.BURSTS}),
        (np.delete(arrivals(), [50, 51, 120]), {Fault.SOME_LOST}),
        (np.delete(arrivals(), np.arange(5, 290, 7)), {Fault.MANY_LOST, Fault.JITTER}),
    ],
)
def test_each_fault_is_found_and_no_other(times: np.ndarray, faults: set[Fault]) -> None:
    assert faults_of(times) == faults


@settings(deadline=None)
@given(
    st.floats(20, 500),
    st.floats(0, 0.6),
    st.sets(st.integers(20, 270), max_size=12),
    st.integers(0, 99),
)
def test_lost_samples_are_counted_and_late_ones_are_not(
    rate_hz: float, jitter: float, lost: set[int], seed: int
) -> None:
    times = np.delete(arrivals(rate_hz, 300, jitter, seed), sorted(lost))
    numbers = number_samples(times, 1 / rate_hz)
    assert list(numbers) == [k for k in range(300) if k not in lost]


def test_the_figures_are_the_ones_of_the_arrivals() -> None:
    late = arrivals(100.0, 301)
    late[150] += 0.004
    finding = check_jitter(late, 0.01)
    assert (
        finding.fault is None
        and "0.00 ms (p50)" in finding.observed
        and "4.0 ms (most)" in finding.observed
    )
    assert check_losses(np.delete(late, 200), 0.01).observed == "1 of 301 lost"
    assert check_rate(arrivals(80.0), 100.0).observed == "80.0 Hz"


def test_samples_that_are_late_at_the_end_are_not_lost() -> None:
    times = arrivals()
    times[-3:] += 0.02
    assert check_losses(times, 0.01).observed == "0 of 300 lost"


def test_hardly_any_samples_are_a_wrong_rate() -> None:
    finding = check_rate(arrivals(count=7), 100.0)
    assert (finding.fault, finding.observed) == (Fault.RATE_WRONG, "7 samples in all")
