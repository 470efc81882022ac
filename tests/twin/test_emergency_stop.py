"""The stop latches, drops commands, and is cleared after a zero, or in silence."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pendulum_twin.emergency_stop import (
    Stop,
    StopAnswer,
    clear_stop,
    drop_command,
    let_time_pass,
    press_stop,
)

SILENCE_S = 0.2


def test_pressed_and_cleared_by_a_zero() -> None:
    latched = press_stop(Stop())
    assert latched.latched
    assert clear_stop(latched, SILENCE_S) == (latched, StopAnswer.ZERO_FIRST)
    open_again, answer = clear_stop(drop_command(latched, 0.0), SILENCE_S)
    assert answer is StopAnswer.CLEARED and open_again == Stop(dropped=1)


def test_silence_counts_as_zero() -> None:
    latched = press_stop(Stop())
    assert clear_stop(let_time_pass(latched, 0.19), SILENCE_S)[1] is StopAnswer.ZERO_FIRST
    assert clear_stop(let_time_pass(latched, 0.21), SILENCE_S)[1] is StopAnswer.CLEARED
    still_sent = drop_command(let_time_pass(latched, 5.0), 0.3)
    assert clear_stop(let_time_pass(still_sent, 0.1), SILENCE_S)[1] is StopAnswer.ZERO_FIRST
    assert clear_stop(let_time_pass(still_sent, 0.3), SILENCE_S)[1] is StopAnswer.CLEARED


def test_a_clock_that_is_set_back_is_no_silence() -> None:
    latched = let_time_pass(press_stop(Stop()), 0.15)
    assert clear_stop(let_time_pass(latched, -9.0), SILENCE_S)[1] is StopAnswer.ZERO_FIRST


def test_nothing_to_clear() -> None:
    idle = let_time_pass(Stop(dropped=3), 9.0)
    assert clear_stop(idle, SILENCE_S) == (Stop(dropped=3), StopAnswer.NOT_STOPPED)


@pytest.mark.parametrize("last", [0.1, -0.5, math.nan, math.inf, 1e-9])
def test_whoever_still_sends_something_cannot_clear(last: float) -> None:
    stop = drop_command(drop_command(press_stop(Stop()), 0.0), last)
    assert clear_stop(stop, SILENCE_S)[1] is StopAnswer.ZERO_FIRST


def test_pressed_again_it_wants_another_zero() -> None:
    pressed = press_stop(let_time_pass(drop_command(press_stop(Stop()), 0.0), 9.0))
    assert clear_stop(pressed, SILENCE_S)[1] is StopAnswer.ZERO_FIRST


EVENTS = st.lists(st.sampled_from(["press", "clear", "wait", 0.0, 0.3, math.nan]))


@given(EVENTS)
def test_it_opens_only_by_a_clear_after_a_zero_or_silence(events: list) -> None:
    stop, safe, dropped = Stop(), False, 0
    for event in events:
        before = stop
        if event == "press":
            stop, safe = press_stop(stop), False
            assert stop.latched
        elif event == "clear":
            stop, _ = clear_stop(stop, SILENCE_S)
            assert stop.latched == (before.latched and not safe)
        elif event == "wait":
            stop, safe = let_time_pass(stop, 1.0), True
            assert stop.latched == before.latched
        elif stop.latched:
            stop, safe, dropped = drop_command(stop, event), event == 0.0, dropped + 1
            assert stop.latched
    assert stop.dropped == dropped
