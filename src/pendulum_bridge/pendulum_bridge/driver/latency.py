"""How long something takes, over the last so many times."""

from __future__ import annotations

from collections import deque

KEPT_DURATIONS = 1000


class Latency:
    """Keep the last KEPT durations."""

    def __init__(self) -> None:
        self._kept: deque[float] = deque(maxlen=KEPT_DURATIONS)

    def add(self, seconds: float) -> None:
        """Take a duration; a negative one (a clock was set) is left out."""
        if seconds >= 0:
            self._kept.append(seconds)

    def summarize(self, name: str) -> dict[str, float]:
        """Return the median and the 99th percentile, ms, named; nothing when there was nothing yet."""
        ordered = sorted(self._kept)
        return {
            f"{name}_p{share}_ms": 1e3 * ordered[share * (len(ordered) - 1) // 100]
            for share in (50, 99)
            if ordered
        }
