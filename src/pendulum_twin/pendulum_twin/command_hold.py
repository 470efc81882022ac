"""Which command acts now: the last one that was good, clipped, and only while it is fresh."""

from __future__ import annotations

import math

NEVER_NS = -(10**18)


class CommandHold:
    """Keep the last command and say what of it is applied.

    limit: largest magnitude (PWM fraction); None for no limit. timeout_s: a command older than this counts as 0.
    refused: how many commands were no finite numbers.
    """

    def __init__(self, limit: float | None, timeout_s: float) -> None:
        self._limit = math.inf if limit is None else limit
        self._timeout_ns = round(timeout_s * 1e9)
        self.refused = 0
        self.clear()

    def clear(self) -> None:
        """Forget the last command; the count of refused ones stays."""
        self._command, self._received_ns = 0.0, NEVER_NS

    def offer(self, command: float, now_ns: int) -> bool:
        """Take a command that arrived at now_ns, and return True; refuse and count one that is NaN or infinite."""
        if not math.isfinite(command):
            self.refused += 1
            return False
        self._command, self._received_ns = min(max(command, -self._limit), self._limit), now_ns
        return True

    def at(self, now_ns: int) -> float:
        """Return the command to apply from now_ns on."""
        return self._command if now_ns - self._received_ns <= self._timeout_ns else 0.0
