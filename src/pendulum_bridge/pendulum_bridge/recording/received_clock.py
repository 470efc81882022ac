"""Simulated time at the moment something was received, when `/clock` runs faster than anyone asks for it."""

from __future__ import annotations

import struct
from bisect import bisect_right


class ReceivedClock:
    """Tell the simulated time by the `/clock` messages received so far; real and simulated times in ns."""

    def __init__(self) -> None:
        self._received: list[int] = []
        self._simulated: list[int] = []

    def hear(self, received_ns: int, data: bytes) -> None:
        """Take a serialised `rosgraph_msgs/Clock`; they come in order."""
        seconds, nanoseconds = struct.unpack_from("<iI" if data[1] & 1 else ">iI", data, 4)
        self._received.append(received_ns)
        self._simulated.append(seconds * 10**9 + nanoseconds)

    def at(self, received_ns: int) -> int | None:
        """Return the simulated time when something was received, None before the first clock message."""
        k = bisect_right(self._received, received_ns)
        return self._simulated[k - 1] if k else None

    def forget_before_last(self) -> None:
        """Forget all but the last message; nothing older will be asked for."""
        del self._received[:-1], self._simulated[:-1]
