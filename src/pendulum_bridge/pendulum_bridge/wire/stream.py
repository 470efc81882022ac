"""A connected TCP socket as a row of frames, all of one length: a packet of the protocol each."""

from __future__ import annotations

import contextlib
import socket

from pendulum_bridge.wire.receive_time import (
    ANCILLARY_BYTES,
    request_arrival_times,
    read_arrival_ns,
)

BROKEN_MS = 1000  # what stays unacknowledged for so long breaks the connection: a rig without power says nothing


class Stream:
    """Send and receive frames of `size` bytes without ever waiting; it takes the socket over."""

    def __init__(self, connected: socket.socket, size: int) -> None:
        connected.setblocking(False)
        connected.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        if hasattr(socket, "TCP_USER_TIMEOUT"):
            connected.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, BROKEN_MS)
        request_arrival_times(connected)
        self._socket, self._size = connected, size
        self._coming, self._going = b"", b""  # parts of a frame

    def fileno(self) -> int:
        """Return the socket's number."""
        return self._socket.fileno()

    def send(self, frame: bytes) -> None:
        """Send a frame, or lose it while the other side does not read; raise OSError when the connection is broken.

        A frame is lost as a whole: what went out of it is followed by its rest before the next.
        """
        with contextlib.suppress(BlockingIOError):
            if self._going:
                self._going = self._going[self._socket.send(self._going) :]
            if not self._going:
                self._going = frame[self._socket.send(frame) :]

    def take_frame(self) -> tuple[bytes, int] | None:
        """Return the next frame that is there, and when its last byte came (ns of the system's clock); None for none.

        Raises OSError when the connection is broken or was closed.
        """
        try:
            while len(self._coming) < self._size:
                part, ancillary, _, _ = self._socket.recvmsg(
                    self._size - len(self._coming), ANCILLARY_BYTES
                )
                if not part:
                    raise ConnectionResetError("closed by the other side")
                self._coming += part
        except BlockingIOError:
            return None
        frame, self._coming = self._coming, b""
        return frame, read_arrival_ns(ancillary)

    def shut(self) -> None:
        """End the connection, whoever else still holds the socket; it has to be closed yet."""
        with contextlib.suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        """End the connection and give the socket back."""
        self.shut()
        self._socket.close()
