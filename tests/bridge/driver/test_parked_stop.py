"""Without a driver the emergency stop keeps its rule: 0, or silence, before it is cleared."""

from pendulum_bridge.driver.parked_stop import ParkedStop
from pendulum_bridge.safety.reasons import Reason

SILENCE_S = 0.2


class Clock:
    """A clock that the test sets, s."""

    now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


def test_silence_clears_it_and_commands_do_not() -> None:
    clock = Clock()
    stop = ParkedStop(clock)
    assert stop.clear(SILENCE_S) is Reason.NOT_STOPPED
    stop.drop_command(0.3)  # before it is pressed nothing counts
    stop.put(True)
    for _ in range(10):
        clock.now_s += 0.15
        assert stop.clear(SILENCE_S) is Reason.ZERO_FIRST and stop.latched
        stop.drop_command(0.3)
    clock.now_s += 0.25
    assert stop.clear(SILENCE_S) is Reason.STOP_CLEARED and not stop.latched


def test_a_command_of_0_clears_it_at_once_until_another_comes() -> None:
    stop = ParkedStop(Clock())
    stop.put(True)
    stop.drop_command(0.0)
    stop.drop_command(0.1)
    assert stop.clear(SILENCE_S) is Reason.ZERO_FIRST
    stop.drop_command(0.0)
    assert stop.clear(SILENCE_S) is Reason.STOP_CLEARED
    stop.put(True)
    assert stop.clear(SILENCE_S) is Reason.ZERO_FIRST
    stop.put(False)
    assert stop.clear(SILENCE_S) is Reason.NOT_STOPPED
