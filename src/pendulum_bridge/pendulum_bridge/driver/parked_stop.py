"""The emergency stop of a driver node that has no driver now: it is cleared by the same rule."""

from __future__ import annotations

from collections.abc import Callable
from time import monotonic

from pendulum_bridge.safety.events import STOP_REASONS
from pendulum_bridge.safety.reasons import Reason
from pendulum_twin import emergency_stop
from pendulum_twin.emergency_stop import Stop


class ParkedStop:
    """Hold the stop, and what the commands since it was pressed say of clearing it.

    now: s, monotonic; the clock.
    """

    def __init__(self, now: Callable[[], float] = monotonic) -> None:
        self._now, self._stop, self._read_s = now, Stop(), now()

    @property
    def latched(self) -> bool:
        """Whether the stop is pressed."""
        return self._stop.latched

    def put(self, latched: bool) -> None:
        """Take over the stop of a driver that ends: pressed anew, or not pressed."""
        self._stop = emergency_stop.press_stop(self._stop) if latched else Stop()
        self._read_s = self._now()

    def drop_command(self, command: float) -> None:
        """Note a command (PWM fraction), which goes nowhere."""
        if self._stop.latched:
            self._stop, self._read_s = (
                emergency_stop.drop_command(self._stop, command),
                self._now(),
            )

    def clear(self, silence_s: float) -> Reason:
        """Clear the stop, or return why it stays.

        silence_s: s; after so long without a command silence counts as a command of 0.
        """
        now_s = self._now()
        stop = emergency_stop.let_time_pass(self._stop, now_s - self._read_s)
        self._stop, answer = emergency_stop.clear_stop(stop, silence_s)
        self._read_s = now_s
        return STOP_REASONS[answer]
