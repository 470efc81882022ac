"""Samples that a driver which is behind has taken, and has not published yet."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable

from pendulum_bridge.wire.link import Arrival

MOST_UNPUBLISHED = 1000  # samples; a driver that stays behind drops the oldest


class WaitingSamples:
    """Keep samples in order until they are published.

    dropped: how many samples were dropped, and never published.
    """

    def __init__(self) -> None:
        self._waiting: deque[Arrival] = deque()
        self.dropped = 0

    def add(self, arrivals: Iterable[Arrival]) -> None:
        """Append samples; of more than MOST_UNPUBLISHED, drop the oldest."""
        self._waiting.extend(arrivals)
        while len(self._waiting) > MOST_UNPUBLISHED:
            self._waiting.popleft()
            self.dropped += 1

    def take_oldest(self) -> Arrival | None:
        """Remove and return the sample that has waited longest; None if no sample waits."""
        return self._waiting.popleft() if self._waiting else None
