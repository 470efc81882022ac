"""Decide when samples are due: at evenly spaced times, however unevenly the clock is read."""

from __future__ import annotations

from math import floor

LONGEST_BACKLOG_S = 0.25  # of samples that are still made up for


class SampleClock:
    """Give out sampling times, each exactly a period after the last.

    A time is due from half a period before it, so that a timer's jitter neither skips nor doubles
    a sample. After a standstill of more than LONGEST_BACKLOG_S the times between are given up; a
    clock that was set back begins anew.

    period_s: s from sample to sample.
    lost: how many times were given up.
    """

    def __init__(self, period_s: float) -> None:
        self._period_ns = period_s * 1e9
        self._first_ns: int | None = None
        self._given = 0
        self.lost = 0

    def take_due_times(self, now_ns: int) -> list[int]:
        """Return the sampling times, ns, that are due at now_ns and were not given out yet."""
        if self._first_ns is None:
            self._first_ns = now_ns
        behind = floor((now_ns - self._first_ns) / self._period_ns + 0.5) + 1 - self._given
        # the newest time that is due is not late; of a clock that was set back none is due
        if (behind - 1) * self._period_ns > LONGEST_BACKLOG_S * 1e9:
            self.lost += behind - 1
            self._given, behind = self._given + behind - 1, 1
        elif -behind * self._period_ns > LONGEST_BACKLOG_S * 1e9:
            self._first_ns, self._given, behind = now_ns, 0, 1
        times = [
            self._first_ns + round((self._given + k) * self._period_ns)
            for k in range(max(behind, 0))
        ]
        self._given += len(times)
        return times
