"""Repeat a measurement of time until the machine stood still nowhere in it."""

import time
from collections.abc import Callable

PATIENCE_S = 300.0


def repeat_until_right[T](
    measure: Callable[[], T], is_right: Callable[[T], bool], patience_s: float = PATIENCE_S
) -> T:
    """Return the first measurement that is right; fail with the last when patience is over.

    What is wrong by itself is wrong each time; what is late because the machine is busy is not.
    """
    end = time.monotonic() + patience_s
    while not is_right(measurement := measure()):
        assert time.monotonic() < end, f"not once right in {patience_s:g} s; last: {measurement}"
    return measurement
