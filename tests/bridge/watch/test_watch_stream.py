"""Samples and commands on one even clock."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pendulum_bridge.watch.stream import Stream

PERIOD_S, PERIOD_NS = 0.01, 10_000_000


def feed(stamps_ns: list[int], slots: int = 400, answers: float = 0.75) -> Stream:
    """Return a stream of samples whose cart position is their number, answered by that number."""
    stream = Stream(PERIOD_S, slots, answers)
    for k, stamp_ns in enumerate(stamps_ns):
        stream.sample(stamp_ns, k * PERIOD_NS, (float(k), 3.0))
        stream.command(float(k), k * PERIOD_NS + 1_000_000)
    return stream


@given(st.integers(0, 2**32 - 1))
def test_even_samples_keep_their_slots_when_stamps_scatter(seed: int) -> None:
    random = np.random.default_rng(seed)
    stamps = [k * PERIOD_NS + int(random.normal(0, 0.0007) * 1e9) for k in range(300)]
    stream = feed(stamps)
    assert (stream.lost, stream.late, stream.begun) == (0, 0, 1)
    assert np.array_equal(stream.history(stream.slot).positions[:, 0], np.arange(300.0))


def test_a_slow_clock_is_followed() -> None:
    stream = feed([round(k * PERIOD_NS * 1.003) for k in range(2000)])
    assert (stream.lost, stream.late) == (0, 0)
    assert stream.rate_hz == pytest.approx(100 / 1.003, rel=1e-3)


@pytest.mark.parametrize(("factor", "hz"), [(2.0, 50.0), (0.5, 200.0)])
def test_a_wrong_rate_is_told(factor: float, hz: float) -> None:
    assert feed([round(k * PERIOD_NS * factor) for k in range(400)]).rate_hz == pytest.approx(
        hz, rel=0.02
    )


def test_a_few_lost_samples_do_not_change_the_rate() -> None:
    stream = Stream(PERIOD_S, 400)
    for k in range(400):
        if k % 20:
            stream.sample(k * PERIOD_NS, k * PERIOD_NS, (0.0, 3.0))
    assert stream.lost == 19 and stream.rate_hz == pytest.approx(100.0, rel=1e-6)


def test_lost_samples_leave_empty_slots_and_take_no_commands_along() -> None:
    stream = Stream(PERIOD_S, 100)
    for k in range(20):
        if k not in (7, 8, 12):
            stream.sample(k * PERIOD_NS, k * PERIOD_NS, (float(k), 3.0))
        stream.command(float(k), k * PERIOD_NS + 1_000_000)
    history = stream.history(stream.slot)
    assert np.flatnonzero(np.isnan(history.positions[:, 0])).tolist() == [7, 8, 12]
    assert history.command[:-1].tolist() == [float(k) for k in range(19)]


def test_a_silence_begins_anew() -> None:
    stream = feed(
        [k * PERIOD_NS for k in range(50)] + [(k + 30) * PERIOD_NS for k in range(50, 60)]
    )
    assert stream.begun == 2 and stream.length == 10


def test_a_clock_that_is_set_back_begins_anew() -> None:
    assert (
        feed(
            [10**10 + k * PERIOD_NS for k in range(50)] + [k * PERIOD_NS for k in range(10)]
        ).begun
        == 2
    )


def test_commands_go_on_when_the_clock_is_set_back() -> None:
    stream = Stream(PERIOD_S, 100)
    for k in range(40):
        now_ns = k * PERIOD_NS + (10**12 if k < 20 else 0)
        stream.sample(now_ns, now_ns, (float(k), 3.0))
        stream.command(float(k), now_ns + 1_000_000)
    assert stream.begun == 2
    assert stream.history(stream.slot).command[:-1].tolist() == [float(k) for k in range(20, 39)]


def test_a_repeated_sample_is_late() -> None:
    stream = feed([k * PERIOD_NS for k in range(50)])
    assert not stream.sample(49 * PERIOD_NS, 50 * PERIOD_NS, (0.0, 3.0)) and stream.late == 1


@pytest.mark.parametrize(
    ("after_ms", "answers", "slot"),
    [(1.0, 0.75, 5), (5.1, 0.75, 5), (8.0, 0.75, 6), (9.99, 1.0, 5)],
    ids=["an answer", "a twin in real time", "all but the next", "a twin in lockstep"],
)
def test_which_period_a_command_acts_on(after_ms: float, answers: float, slot: int) -> None:
    stream = Stream(PERIOD_S, 100, answers)
    for k in range(10):
        stream.sample(k * PERIOD_NS, k * PERIOD_NS, (0.0, 3.0))
        if k == 5:
            stream.command(0.3, k * PERIOD_NS + round(after_ms * 1e6))
    held = stream.history(stream.slot).command[:-1]
    assert held.tolist() == [0.0] * slot + [0.3] * (9 - slot)


def test_commands_that_are_no_numbers_are_passed_over() -> None:
    stream = Stream(PERIOD_S, 100)
    for k in range(5):
        stream.sample(k * PERIOD_NS, k * PERIOD_NS, (0.0, 3.0))
        stream.command(math.nan if k == 3 else 0.1, k * PERIOD_NS + 1)
    assert stream.history(stream.slot).command[:-1].tolist() == [0.1] * 4


def test_whole_turns_are_taken_off_and_slips_are_not() -> None:
    stream = Stream(PERIOD_S, 100)
    angles = [3.0, 3.1, 3.1 - 2 * math.pi, 3.2 - 2 * math.pi, 3.2 + 0.4]
    for k, angle in enumerate(angles):
        stream.sample(k * PERIOD_NS, k * PERIOD_NS, (0.0, angle))
    assert stream.history(stream.slot).positions[:, 1] == pytest.approx([3.0, 3.1, 3.1, 3.2, 3.6])
    assert stream.begun == 1


def test_both_joints_jumping_at_once_is_a_reset() -> None:
    stream = Stream(PERIOD_S, 100)
    for k in range(20):
        stream.sample(k * PERIOD_NS, k * PERIOD_NS, (0.3, 5.0) if k < 10 else (0.0, math.pi))
    assert stream.begun == 2 and stream.length == 10


def test_no_more_than_the_slots_are_kept() -> None:
    stream = feed([k * PERIOD_NS for k in range(500)], slots=60)
    history = stream.history(stream.slot - 10)
    assert stream.length == 60 and len(history.command) == len(history.positions) == 50
    assert (
        history.positions[-1, 0] == 489.0
        and history.command[-1] == 489.0
        and history.end_ns == 489 * PERIOD_NS
    )
