"""When the next sample is due: at whole numbers of periods since the start, however long the last one took."""

from __future__ import annotations

import time
from collections.abc import Callable

LONGEST_BACKLOG_S = 0.25


class Schedule:
    """Wait for evenly spaced times.

    interval_s: from one to the next. Who is late goes on at once and catches up; what a standstill
    of more than LONGEST_BACKLOG_S left behind is given up, and summed in `given_up_s`. now, sleep:
    the clock, in s.
    """

    def __init__(
        self,
        interval_s: float,
        now: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self._interval_s, self._now, self._sleep = interval_s, now, sleep
        self._start = now()
        self.given_up_s = 0.0

    def wait_for(self, count: float) -> None:
        """Return at `count` intervals after the start; a fraction is a time between two."""
        early = self._start + count * self._interval_s - self._now()
        if early > 0:
            self._sleep(early)
        elif -early > LONGEST_BACKLOG_S:
            self._start -= early
            self.given_up_s -= early
