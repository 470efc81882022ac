"""Read a clock that runs evenly, and stamp with the system's time.

Somebody who sets the system's clock must not make a real-time twin stand still or leap.
"""

from __future__ import annotations

import time
from collections.abc import Callable

FOLLOWED_NS = 1_000_000  # the system's time is followed in steps of at least this
# between two looks at one clock, with a look at the other between them: longer where the computer
# stands still meanwhile, and then the two do not belong together
TOGETHER_NS = 100_000
MOST_LOOKS = 5


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
        self._offset_ns, _ = self._compare_clocks()

    def read_ns(self) -> int:
        """Return the even clock's time, ns."""
        return self._steady_ns()

    def to_stamp(self, at_ns: int) -> int:
        """Return the system's time, ns, at a time of the even clock."""
        offset_ns, apart_ns = self._compare_clocks()
        if apart_ns <= TOGETHER_NS and abs(offset_ns - self._offset_ns) >= FOLLOWED_NS:
            self._offset_ns = offset_ns
        return at_ns + self._offset_ns

    def _compare_clocks(self) -> tuple[int, int]:
        """Return the difference of the clocks, and the time between the looks at them, both ns."""
        best = self._look_at_clocks()
        for _ in range(MOST_LOOKS - 1):
            if best[1] <= TOGETHER_NS:
                break
            best = min(best, self._look_at_clocks(), key=lambda looked: looked[1])
        return best

    def _look_at_clocks(self) -> tuple[int, int]:
        before_ns = self._steady_ns()
        system_ns = self._system_ns()
        return system_ns - before_ns, self._steady_ns() - before_ns
