"""The durations of a repeated operation: median and 99th percentile of the last ones."""

from __future__ import annotations

from collections import deque

KEPT_DURATIONS = 1000


class Latency:
    """Keep the last KEPT_DURATIONS durations."""

    def __init__(self) -> None:
        self._kept: deque[float] = deque(maxlen=KEPT_DURATIONS)

    def add(self, seconds: float) -> None:
        """Add a duration, s; a negative duration (a clock was set) is left out."""
        if seconds >= 0:
            self._kept.append(seconds)

    def summarize(self, name: str) -> dict[str, float]:
        """Return the median and the 99th percentile, ms; an empty mapping without data.

        name: the beginning of the keys.
        """
        ordered = sorted(self._kept)
        return {
            f"{name}_p{share}_ms": 1e3 * ordered[share * (len(ordered) - 1) // 100]
            for share in (50, 99)
            if ordered
        }
