"""Decide which command acts now: the last good command, clipped, while it is fresh."""

from __future__ import annotations

import math


class CommandHold:
    """Keep the last command.

    limit: largest magnitude, PWM fraction; None for no limit; it may be set anew at any time.
    timeout_s: s; an older command counts as 0.
    taken: how many commands were finite numbers.
    refused: how many commands were not.
    """

    def __init__(self, limit: float | None, timeout_s: float) -> None:
        self.limit = limit
        self._timeout_ns = timeout_s * 1e9
        self.taken = self.refused = 0
        self.clear()

    def clear(self) -> None:
        """Forget the last command; the counts stay."""
        self._command = 0.0
        self._received_ns: int | None = None

    def offer(self, command: float, now_ns: int) -> bool:
        """Take a command that arrived at now_ns and return True; refuse NaN and infinity."""
        if not math.isfinite(command):
            self.refused += 1
            return False
        self.taken += 1
        self._command, self._received_ns = command, now_ns
        return True

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
