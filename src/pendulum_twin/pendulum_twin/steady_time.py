"""Read a clock that runs evenly, and stamp with the system's time.

Somebody who sets the system's clock must not make a real-time twin stand still or leap.
"""

from __future__ import annotations

import time
from collections.abc import Callable

FOLLOWED_NS = 1_000_000  # the system's time is followed in steps of at least this


class SteadyTime:
    """Hold the difference between the system's time and an even clock.

    steady_ns, system_ns: the clocks, ns.
    """

    def __init__(
        self,
        steady_ns: Callable[[], int] = time.monotonic_ns,
        system_ns: Callable[[], int] = time.time_ns,
    ) -> None:
        self._steady_ns, self._system_ns = steady_ns, system_ns
        self._offset_ns = system_ns() - steady_ns()

    def read_ns(self) -> int:
        """Return the even clock's time, ns."""
        return self._steady_ns()

    def to_stamp(self, at_ns: int) -> int:
        """Return the system's time, ns, at a time of the even clock."""
        offset_ns = self._system_ns() - self._steady_ns()
        if abs(offset_ns - self._offset_ns) >= FOLLOWED_NS:
            self._offset_ns = offset_ns
        return at_ns + self._offset_ns
