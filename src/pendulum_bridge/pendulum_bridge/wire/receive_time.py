"""The time at which the kernel received a packet: right even when the reading process slept."""

from __future__ import annotations

import socket
import struct
import sys
import time
from collections.abc import Iterable

# Linux's number of the option on all but a few old machines; Python does not name it
SO_TIMESTAMPNS = 35
TIMESPEC = struct.Struct("@qq")  # seconds, nanoseconds
ANCILLARY_BYTES = socket.CMSG_SPACE(TIMESPEC.size) if sys.platform == "linux" else 0

Ancillary = Iterable[tuple[int, int, bytes]]


def request_arrival_times(opened: socket.socket) -> None:
    """Ask the kernel to note when packets come; a system that cannot is left as it is."""
    if sys.platform == "linux":
        try:
            opened.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPNS, 1)
        except OSError:
            return


def read_arrival_ns(ancillary: Ancillary) -> int:
    """Return when a packet came (ns, system clock); the present when the kernel did not note it.

    ancillary: what `recvmsg` returned beside the packet.
    """
    for level, kind, data in ancillary:
        if (level, kind, len(data)) == (socket.SOL_SOCKET, SO_TIMESTAMPNS, TIMESPEC.size):
            seconds, nanoseconds = TIMESPEC.unpack(data)
            return int(seconds) * 10**9 + int(nanoseconds)
    return time.time_ns()
