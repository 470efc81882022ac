"""When a packet reached this machine, by the kernel: true even when the process that reads it was not running then."""

from __future__ import annotations

import socket
import struct
import sys
import time
from collections.abc import Iterable

# Linux's number on all but a few old machines; Python does not name it
SO_TIMESTAMPNS = 35
TIMESPEC = struct.Struct("@qq")  # seconds, nanoseconds
ANCILLARY_BYTES = socket.CMSG_SPACE(TIMESPEC.size) if sys.platform == "linux" else 0

Ancillary = Iterable[tuple[int, int, bytes]]


def request_arrival_times(opened: socket.socket) -> None:
    """Have the kernel note when packets come; where it cannot, `read_arrival_ns` gives the time of reading."""
    if sys.platform == "linux":
        try:
            opened.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPNS, 1)
        except OSError:
            return


def read_arrival_ns(ancillary: Ancillary) -> int:
    """Return when a packet came (ns of the system's clock), from what `recvmsg` gave beside it."""
    for level, kind, data in ancillary:
        if (level, kind, len(data)) == (socket.SOL_SOCKET, SO_TIMESTAMPNS, TIMESPEC.size):
            seconds, nanoseconds = TIMESPEC.unpack(data)
            return int(seconds) * 10**9 + int(nanoseconds)
    return time.time_ns()
