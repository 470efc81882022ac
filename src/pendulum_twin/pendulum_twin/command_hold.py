"""Decide which command acts now: the last good command, clipped, while it is fresh.

During an emergency stop no command acts.
"""

from __future__ import annotations

import math

from pendulum_twin import emergency_stop
from pendulum_twin.emergency_stop import Stop, StopAnswer


class CommandHold:
    """Keep the last command.

    limit: largest magnitude, PWM fraction; None for no limit; it may be set anew at any time.
    timeout_s: s; an older command counts as 0.
    taken: how many commands were finite numbers.
    refused: how many commands were not.
    stop: the emergency stop.
    """

    def __init__(self, limit: float | None, timeout_s: float) -> None:
        self.limit = limit
        self._timeout_ns = timeout_s * 1e9
        self.stop = Stop()
        self._stop_ns = 0  # the time up to which the stop has counted silence
        self.taken = self.refused = 0
        self.clear()

    def clear(self) -> None:
        """Forget the last command; the counts stay."""
        self._command = 0.0
        self._received_ns: int | None = None

    def offer(self, command: float, now_ns: int) -> bool:
        """Take a command that arrived at now_ns and return True; refuse NaN and infinity.

        During an emergency stop a command is dropped, which is no refusal.
        """
        if self.stop.latched:
            self._stop_ns = now_ns
            self.stop = emergency_stop.drop_command(self.stop, command)
        if not math.isfinite(command):
            self.refused += 1
            return False
        self.taken += 1
        if not self.stop.latched:
            self._command, self._received_ns = command, now_ns
        return True

    def press_stop(self, now_ns: int) -> StopAnswer:
        """Latch the emergency stop at now_ns and forget the last command."""
        self.clear()
        self._stop_ns = now_ns
        self.stop = emergency_stop.press_stop(self.stop)
        return StopAnswer.STOPPED

    def clear_stop(self, now_ns: int) -> StopAnswer:
        """Clear the emergency stop at now_ns, or say why it stays."""
        passed_s = 1e-9 * (now_ns - self._stop_ns)
        self._stop_ns = now_ns
        self.stop = emergency_stop.let_time_pass(self.stop, passed_s)
        self.stop, answer = emergency_stop.clear_stop(self.stop, 1e-9 * self._timeout_ns)
        return answer

    def get_command(self, now_ns: int) -> float:
        """Return the command to apply from now_ns on.

        A clock that was set back makes a command stale, never fresh.
        """
        if self._received_ns is None or abs(now_ns - self._received_ns) > self._timeout_ns:
            return 0.0
        limit = math.inf if self.limit is None else self.limit
        return min(max(self._command, -limit), limit)

    def compute_age_s(self, now_ns: int) -> float | None:
        """Return the age of the last command, s; None when there was none since `clear`."""
        return None if self._received_ns is None else (now_ns - self._received_ns) / 1e9
