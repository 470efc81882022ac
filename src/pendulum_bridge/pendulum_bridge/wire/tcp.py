"""The rig's packets over TCP: a connection that is watched and renewed without blocking."""

from __future__ import annotations

import errno
import os
import select
import socket
import time
from collections.abc import Callable
from threading import Lock

from pendulum_bridge.wire.link import Link
from pendulum_bridge.wire.protocol import SAMPLE, Sample
from pendulum_bridge.wire.stream import Stream
from pendulum_bridge.wire.udp import MOST_PACKETS_AT_ONCE, Address, resolve_host
from pendulum_twin.errors import BadInputError

CONNECT_S = 1.0  # longest duration of an attempt
RETRY_S = 0.2  # from the end of one attempt or connection to the next attempt


def open_tcp_link(rig: Address) -> Link:
    """Return a link to a rig that listens for one TCP connection.

    The first attempt is made at once and may take CONNECT_S. Without a connection `connected` is
    False, `trouble` gives the reason, `send` raises BadInputError, and `receive` connects again.
    Raises BadInputError for an unknown host.
    """
    return Link(port=TcpPort(rig, SAMPLE.size, Sample.unpack))


class TcpPort[Packet]:
    """Be a `RigPort` over TCP. One thread receives and makes connections; any thread may send.

    peer: the address that listens.
    size: bytes of a packet.
    unpack: turns bytes into a packet, and raises BadInputError for bytes that are none.
    """

    def __init__(self, peer: Address, size: int, unpack: Callable[[bytes], Packet]) -> None:
        self._address, self._where = (resolve_host(peer), peer.port), peer
        self._size, self._unpack = size, unpack
        self._lock = Lock()  # held while sending, and while the stream is replaced
        self._stream: Stream | None = None
        self._attempt: socket.socket | None = None
        self._since = self._again = 0.0
        self._trouble = f"not connected to {peer} yet"
        self._connections = self.malformed = self.foreign = 0
        self._begin()
        self._wait(CONNECT_S)
        self._reach()

    @property
    def connected(self) -> bool:
        """Whether there is a connection."""
        return self._stream is not None

    @property
    def trouble(self) -> str:
        """The reason in a sentence why there is no connection; empty while there is one."""
        return "" if self.connected else self._trouble

    @property
    def connections(self) -> int:
        """The number of connections so far."""
        return self._connections

    @property
    def peer(self) -> None:
        """None: the socket itself knows the peer."""
        return None

    def fileno(self) -> int:
        """Return the number of the connection's socket; -1 while there is none."""
        stream = self._stream
        return -1 if stream is None else stream.fileno()

    def send(self, packet: bytes) -> None:
        """Send to the peer; raise BadInputError while it is not connected."""
        with self._lock:
            if self._stream is None:
                raise BadInputError(self._trouble)
            try:
                self._stream.send(packet)
            except OSError as error:
                self._stream.shut()  # the receiving thread sees it and connects again
                raise BadInputError(f"cannot send to {self._where}: {error.strerror}") from error

    def receive(self, deadline: float) -> Packet | None:
        """Return the next packet, or None at the deadline (s, `time.monotonic`)."""
        came = self.receive_stamped(deadline)
        return None if came is None else came[0]

    def receive_stamped(self, deadline: float) -> tuple[Packet, int] | None:
        """Return the next packet and its arrival (ns, system clock), or None at the deadline."""
        while True:
            self._reach()
            if (came := self._take_packet()) is not None:
                return came
            if (left := deadline - time.monotonic()) <= 0:
                return None
            self._wait(left)

    def take_waiting(self) -> list[Packet]:
        """Return all unread packets, oldest first, without blocking."""
        return [packet for packet, _ in self.take_waiting_stamped()]

    def take_waiting_stamped(self) -> list[tuple[Packet, int]]:
        """Return all unread packets and their arrivals (ns, system clock), oldest first."""
        self._reach()
        packets: list[tuple[Packet, int]] = []
        while len(packets) < MOST_PACKETS_AT_ONCE and (came := self._take_packet()) is not None:
            packets.append(came)
        return packets

    def close(self) -> None:
        """End the connection."""
        self._replace_stream(None)
        self._give_up("closed")

    def _take_packet(self) -> tuple[Packet, int] | None:
        while self._stream is not None:
            try:
                came = self._stream.take_frame()
            except OSError as error:
                self._replace_stream(None)
                reason = error.strerror or str(error)
                self._give_up(
                    f"the connection to {self._where} broke: {reason}; "
                    "the rig takes one at a time, is it another's?"
                )
                return None
            if came is None:
                return None
            try:
                return self._unpack(came[0]), came[1]
            except BadInputError:
                self.malformed += 1
        return None

    def _wait(self, left: float) -> None:
        """Wait at most left s for a packet, a connection, or the time of the next attempt."""
        if self._stream is not None:
            select.select([self._stream], [], [], left)
        elif self._attempt is not None:
            select.select([], [self._attempt], [], left)
        else:
            select.select([], [], [], min(left, max(self._again - time.monotonic(), 0.0)))

    def _reach(self) -> None:
        """Advance the making of a connection by one step, without blocking."""
        if self._stream is None and self._attempt is None and time.monotonic() >= self._again:
            self._begin()
        if self._attempt is None:
            return
        if select.select([], [self._attempt], [], 0)[1]:
            self._finish_attempt(self._attempt)
        elif time.monotonic() > self._since + CONNECT_S:
            self._fail_attempt("no answer")

    def _begin(self) -> None:
        self._since = time.monotonic()
        self._attempt = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        self._attempt.setblocking(False)
        status = self._attempt.connect_ex(self._address)
        if status not in (0, errno.EINPROGRESS):
            self._fail_attempt(os.strerror(status))

    def _finish_attempt(self, attempt: socket.socket) -> None:
        """Take over the connection of an attempt that has ended, or note why it failed."""
        if status := attempt.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR):
            self._fail_attempt(os.strerror(status))
        elif attempt.getsockname() == self._address:
            # nobody listened, and the system connected the socket to itself
            self._fail_attempt("Connection refused")
        else:
            self._attempt = None
            self._replace_stream(Stream(attempt, self._size))
            self._connections += 1

    def _fail_attempt(self, reason: str) -> None:
        self._give_up(
            f"cannot connect to {self._where}: {reason}; "
            "see that the rig is on and listens there over TCP"
        )

    def _give_up(self, trouble: str) -> None:
        if self._attempt is not None:
            self._attempt.close()
        self._attempt, self._again, self._trouble = None, time.monotonic() + RETRY_S, trouble

    def _replace_stream(self, stream: Stream | None) -> None:
        with self._lock:
            if self._stream is not None:
                self._stream.close()
            self._stream = stream
