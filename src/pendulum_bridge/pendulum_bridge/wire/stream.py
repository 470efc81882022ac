"""A connected TCP socket as frames of equal length: a packet of the protocol each."""

from __future__ import annotations

import contextlib
import socket

from pendulum_bridge.wire.receive_time import (
    ANCILLARY_BYTES,
    read_arrival_ns,
    request_arrival_times,
)

# bytes that stay unacknowledged for so long break the connection: a rig without power is silent
BROKEN_MS = 1000


class Stream:
    """Send and receive frames without blocking.

    connected: the socket, which the stream takes over.
    size: bytes of a frame.
    """

    def __init__(self, connected: socket.socket, size: int) -> None:
        connected.setblocking(False)
        connected.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        if hasattr(socket, "TCP_USER_TIMEOUT"):
            connected.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, BROKEN_MS)
        request_arrival_times(connected)
        self._socket, self._size = connected, size
        self._coming, self._going = b"", b""  # pieces of a frame

    def fileno(self) -> int:
        """Return the socket's number."""
        return self._socket.fileno()

    def send(self, frame: bytes) -> None:
        """Send a frame, or lose it while the other side does not read.

        A frame is lost as a whole: the remainder of a cut frame goes out before the next frame.
        Raises OSError when the connection is broken.
        """
        with contextlib.suppress(BlockingIOError):
            if self._going:
                self._going = self._going[self._socket.send(self._going) :]
            if not self._going:
                self._going = frame[self._socket.send(frame) :]

    def take_frame(self) -> tuple[bytes, int] | None:
        """Return the next complete frame and its arrival, or None when there is none.

        The arrival is that of the frame's last byte, in ns of the system clock. Raises OSError
        when the
        connection is broken or closed.
        """
        try:
            while len(self._coming) < self._size:
                piece, ancillary, _, _ = self._socket.recvmsg(
                    self._size - len(self._coming), ANCILLARY_BYTES
                )
                if not piece:
                    raise ConnectionResetError("closed by the other side")
                self._coming += piece
        except BlockingIOError:
            return None
        frame, self._coming = self._coming, b""
        return frame, read_arrival_ns(ancillary)

    def shut(self) -> None:
        """End the connection for every process that holds the socket, which stays open."""
        with contextlib.suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        """End the connection and free the socket."""
        self.shut()
        self._socket.close()
