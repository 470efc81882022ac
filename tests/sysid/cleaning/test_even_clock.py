"""Stamps that jitter, of messages some of which are lost: each message has its number."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from support.degraded import make_raw, stamp

from pendulum_sysid.cleaning.clean import clean_recording
from pendulum_sysid.cleaning.even_clock import EvenClock, find_even_clock
from pendulum_sysid.cleaning.paused_clock import find_paused_clock
from pendulum_twin.arrays import Floats, Ints

COUNT = 3000
JITTERS: dict[str, Callable[[np.random.Generator, int], Floats]] = {  # periods
    "one-sided": lambda random, count: np.abs(random.normal(0.0, 0.2, count)),
    "two-sided": lambda random, count: random.normal(0.0, 0.15, count),
    "uniform": lambda random, count: random.uniform(0.0, 0.7, count),
}


def send(jitter: str, lost: float, seed: int) -> tuple[Ints, Floats]:
    """Return the numbers of the messages that came, and their stamps in periods, both (n,)."""
    random = np.random.default_rng(seed)
    numbers = np.flatnonzero(random.random(COUNT) >= lost)
    return numbers, numbers + JITTERS[jitter](random, len(numbers))


def check_numbers(clock: EvenClock | None, numbers: Ints, wrong: int = 0) -> None:
    """Check the numbers from the first message on; a few beside a loss may be one off."""
    assert clock is not None
    off = clock.numbers - (numbers - numbers[0])
    off -= int(np.median(off))  # the first message may be one of the few
    assert np.count_nonzero(off) <= wrong and np.max(np.abs(off)) <= 1


@pytest.mark.parametrize("rate_hz", [50.0, 100.0, 1000.0])
@pytest.mark.parametrize("lost", [0.0, 0.001, 0.005, 0.01, 0.03])
@pytest.mark.parametrize("jitter", JITTERS)
def test_lost_messages_are_counted_beside_jitter(jitter: str, lost: float, rate_hz: float) -> None:
    numbers, places = send(jitter, lost, 1)
    clock = find_even_clock(np.sort(places) / rate_hz)
    check_numbers(clock, numbers, wrong=3)
    assert clock is not None and clock.period_s * rate_hz == pytest.approx(1.0, rel=2e-5)
    assert np.std(clock.off_s) * rate_hz == pytest.approx(np.std(places - numbers), rel=0.03)


@pytest.mark.parametrize("jitter", JITTERS)
def test_messages_are_counted_over_bursts_and_long_gaps(jitter: str) -> None:
    numbers, places = send(jitter, 0.01, 2)
    for begin in (400.0, 1300.0, 2100.0):  # nothing is sent for six periods, then all at once
        held = (places > begin) & (places < begin + 6.0)
        places[held] = begin + 6.0 + 0.02 * np.arange(held.sum())
    kept = (numbers < 700) | (numbers > 1200)
    clock = find_even_clock(0.01 * np.maximum.accumulate(places)[kept])
    check_numbers(clock, numbers[kept], wrong=12)


@pytest.mark.parametrize("jitter", JITTERS)
def test_messages_are_counted_on_a_clock_that_drifts(jitter: str) -> None:
    """By half a period to either side, and 0.1 % fast: a line would lose messages."""
    numbers, places = send(jitter, 0.01, 3)
    places += 0.5 * np.sin(2.0 * np.pi * numbers / COUNT) - 1e-3 * numbers
    clock = find_even_clock(0.01 * np.sort(places))
    check_numbers(clock, numbers, wrong=3)


@pytest.mark.parametrize("lost", [0.01, 0.03])
@pytest.mark.parametrize("deviation", [0.4, 0.7])
def test_a_lost_message_is_not_told_from_a_late_message(deviation: float, lost: float) -> None:
    """Messages trade places: no clock is found, and losses are not taken for pauses."""
    random = np.random.default_rng(4)
    numbers = np.flatnonzero(random.random(COUNT) >= lost)
    stamps = 0.01 * np.sort(numbers + random.normal(0.0, deviation, len(numbers)))
    assert find_even_clock(stamps) is None
    assert find_paused_clock(stamps) is None


@pytest.mark.parametrize("burst", [2, 5, 20])
def test_the_messages_of_a_burst_are_no_clock(burst: int) -> None:
    """On a clock that is fast enough all stamps lie."""
    random = np.random.default_rng(5)
    begins = 0.01 * np.arange(500) + random.uniform(0.0, 0.004, 500)
    stamps = (begins[:, None] + 5e-5 * np.arange(burst)).reshape(-1)
    clock = find_even_clock(stamps)
    assert clock is None or clock.period_s > 1e-4


def test_jitter_beside_lost_samples_is_the_motion_that_was_recorded() -> None:
    raw, random = make_raw(), np.random.default_rng(6)
    count = len(raw.state_stamp_s)
    late_s = np.abs(random.normal(0.0, 0.002, count))
    late_s[0] = 0.0
    stamps = np.sort(raw.state_stamp_s + late_s)
    kept = np.flatnonzero(random.random(count) >= 0.01)
    lossy = replace(
        stamp(raw, stamps),
        state_stamp_s=stamps[kept],
        **{joint: values[kept] for joint, values in raw.positions.items()},
    )
    calm, cleaned = clean_recording(raw).signals, clean_recording(lossy)
    assert [finding.kind for finding in cleaned.findings] == ["gap", "jitter"]
    assert "by 1.2 ms" in cleaned.findings[1].note
    signals = cleaned.signals
    assert signals.period_s == pytest.approx(0.01, rel=2e-5) and len(signals.stretches) == 1
    first = round((signals.clock_s[0] - raw.state_stamp_s[0]) / 0.01)
    error = np.abs(signals.pole - calm.pole[first : first + len(signals)])
    assert np.mean(error == 0.0) > 0.98
