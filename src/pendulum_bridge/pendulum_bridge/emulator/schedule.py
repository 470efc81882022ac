"""Wait until a sample is due, at whole numbers of periods since the start."""

from __future__ import annotations

import time
from collections.abc import Callable

LONGEST_BACKLOG_S = 0.25


class Schedule:
    """Wait for evenly spaced times.

    A caller who is late goes on at once and catches up. After a standstill of more than
    LONGEST_BACKLOG_S the times start anew, and `given_up_s` adds up what was left behind.
    longest_late_s: how late a caller came at most, since it was set to 0.
    interval_s: between two times.
    now, sleep: the clock, in s.
    """

    def __init__(
        self,
        interval_s: float,
        now: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self._interval_s, self._now, self._sleep = interval_s, now, sleep
        self._start = now()
        self.given_up_s = self.longest_late_s = 0.0

    def wait_for(self, count: float) -> float:
        """Wait until `count` intervals after the start, and return how late (s) that is.

        count: may be a fraction.
        """
        early = self._start + count * self._interval_s - self._now()
        self.longest_late_s = max(self.longest_late_s, -early)
        if early > 0:
            self._sleep(early)
        elif -early > LONGEST_BACKLOG_S:
            self._start -= early
            self.given_up_s -= early
        return self._now() - (self._start + count * self._interval_s)
