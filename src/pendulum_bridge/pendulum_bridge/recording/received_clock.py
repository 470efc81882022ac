"""The simulated time at which a message was received."""

from __future__ import annotations

import struct
from bisect import bisect_right


class ReceivedClock:
    """Convert real times (ns) to simulated times (ns) by the `/clock` messages received so far."""

    def __init__(self) -> None:
        self._received: list[int] = []
        self._simulated: list[int] = []

    def take(self, received_ns: int, data: bytes) -> None:
        """Take a serialised `rosgraph_msgs/Clock`, in the order of receiving."""
        seconds, nanoseconds = struct.unpack_from("<iI" if data[1] & 1 else ">iI", data, 4)
        self._received.append(received_ns)
        self._simulated.append(seconds * 10**9 + nanoseconds)

    def convert(self, received_ns: int) -> int | None:
        """Return the simulated time at a real time; None before the first clock message."""
        k = bisect_right(self._received, received_ns)
        return self._simulated[k - 1] if k else None

    def forget_before_last(self) -> None:
        """Forget all messages but the last, when no older time will be converted."""
        del self._received[:-1], self._simulated[:-1]
