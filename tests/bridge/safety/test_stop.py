"""The stop latches, drops commands, and wants a zero before it is cleared."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pendulum_bridge.safety.reasons import Reason
from pendulum_bridge.safety.stop import Stop, clear_stop, drop_command, press_stop


def test_pressed_and_cleared() -> None:
    latched = press_stop(Stop())
    assert latched.latched
    assert clear_stop(latched) == (latched, Reason.ZERO_FIRST)
    open_again, reason = clear_stop(drop_command(latched, 0.0))
    assert reason is Reason.STOP_CLEARED and open_again == Stop(dropped=1)


def test_nothing_to_clear() -> None:
    assert clear_stop(Stop(dropped=3)) == (Stop(dropped=3), Reason.NOT_STOPPED)


@pytest.mark.parametrize("last", [0.1, -0.5, math.nan, math.inf, 1e-9])
def test_whoever_still_sends_something_cannot_clear(last: float) -> None:
    stop = drop_command(drop_command(press_stop(Stop()), 0.0), last)
    assert clear_stop(stop)[1] is Reason.ZERO_FIRST


def test_pressed_again_it_wants_another_zero() -> None:
    assert clear_stop(press_stop(drop_command(press_stop(Stop()), 0.0)))[1] is Reason.ZERO_FIRST


EVENTS = st.lists(st.sampled_from(["press", "clear", 0.0, 0.3, math.nan]))


@given(EVENTS)
def test_it_opens_only_by_a_clear_right_after_a_zero(events: list) -> None:
    stop, last, dropped = Stop(), None, 0
    for event in events:
        before = stop
        if event == "press":
            stop, last = press_stop(stop), None
            assert stop.latched
        elif event == "clear":
            stop, _ = clear_stop(stop)
            assert stop.latched == (before.latched and last != 0.0)
        elif stop.latched:
            stop, last, dropped = drop_command(stop, event), event, dropped + 1
            assert stop.latched
    assert stop.dropped == dropped
