"""A UDP socket for one peer: packets of others, and malformed packets, are dropped and counted."""

from __future__ import annotations

import select
import socket
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Self

from pendulum_bridge.wire.receive_time import (
    ANCILLARY_BYTES,
    read_arrival_ns,
    request_arrival_times,
)
from pendulum_twin.errors import BadInputError

LONGEST_PACKET = 64  # bytes; a longer packet is cut to this, and its length is still wrong
MOST_PACKETS_AT_ONCE = 1000  # packets read in one call, however many still come in


@dataclass(frozen=True)
class Address:
    """Hold an IPv4 host (name or number) and a port; as text HOST:PORT."""

    host: str
    port: int

    def __str__(self) -> str:
        return f"{self.host}:{self.port}"


RIG = Address("127.0.0.1", 16384)  # where the rig listens
USER = Address("127.0.0.1", 16385)  # where the rig sends its samples


def parse_address(text: str) -> Address:
    """Return the address that HOST:PORT gives; raise BadInputError for any other text."""
    host, _, port = text.rpartition(":")
    if not host or not port.isascii() or not port.isdigit() or not 1 <= int(port) <= 65535:
        raise BadInputError(f"expected HOST:PORT with a port from 1 to 65535, found {text!r}")
    return Address(host, int(port))


class Endpoint[Packet]:
    """Receive a peer's packets at one address and send to another.

    A peer may send from any port: the thesis's library uses a new port every time. Close the
    endpoint after use, or use it in a `with`.

    listen: where to receive; loopback unless another address is given.
    peer: where to send; packets are taken from this host only.
    unpack: turns bytes into a packet, and raises BadInputError for bytes that are none.
    peer_port: the only port of the peer that packets are taken from; None for any.

    Raises BadInputError when the address cannot be used.
    """

    def __init__(
        self,
        listen: Address,
        peer: Address,
        unpack: Callable[[bytes], Packet],
        peer_port: int | None = None,
    ) -> None:
        self._peer = (resolve_host(peer), peer.port)
        self._peer_port, self._unpack = peer_port, unpack
        self._socket = bind_socket(listen, socket.SOCK_DGRAM)
        request_arrival_times(self._socket)
        self.malformed = 0
        self.foreign = 0
        self.stranger: Address | None = None  # the sender of the last foreign packet

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Free the address."""
        self._socket.close()

    def fileno(self) -> int:
        """Return the socket's number; -1 once closed."""
        return self._socket.fileno()

    @property
    def connected(self) -> bool:
        """True: UDP needs no connection."""
        return True

    @property
    def trouble(self) -> str:
        """Empty: UDP needs no connection."""
        return ""

    @property
    def connections(self) -> int:
        """1: the socket stays the same."""
        return 1

    @property
    def peer(self) -> tuple[str, int]:
        """The address that packets go to: number and port."""
        return self._peer

    def send(self, packet: bytes) -> None:
        """Send to the peer, whether or not it listens.

        Raises BadInputError when the network refuses.
        """
        try:
            self._socket.sendto(packet, self._peer)
        except BlockingIOError:
            return  # the buffer is full: lost, as on any network
        except OSError as error:
            raise BadInputError(
                f"cannot send to {self._peer[0]}:{self._peer[1]}: {error.strerror}"
            ) from error

    def receive(self, deadline: float) -> Packet | None:
        """Return the next packet of the peer, or None at the deadline (s, `time.monotonic`).

        Packets of others never extend the wait. A deadline in the past takes a packet that waits.
        """
        came = self.receive_stamped(deadline)
        return None if came is None else came[0]

    def receive_stamped(self, deadline: float) -> tuple[Packet, int] | None:
        """Return the peer's next packet and its arrival, or None at the deadline.

        The arrival is in ns of the system clock; the deadline in s of `time.monotonic`.
        """
        while True:
            left = max(deadline - time.monotonic(), 0.0)
            if not select.select([self._socket], [], [], left)[0]:
                return None
            came = self._take_packet()
            if came is not None or not left:
                return came

    def take_waiting(self) -> list[Packet]:
        """Return all unread packets of the peer, oldest first, without blocking."""
        return [packet for packet, _ in self.take_waiting_stamped()]

    def take_waiting_stamped(self) -> list[tuple[Packet, int]]:
        """Return all unread packets and their arrivals (ns, system clock), oldest first."""
        packets = []
        for _ in range(MOST_PACKETS_AT_ONCE):
            if not select.select([self._socket], [], [], 0)[0]:
                break
            came = self._take_packet()
            if came is not None:
                packets.append(came)
        return packets

    def _take_packet(self) -> tuple[Packet, int] | None:
        try:
            packet, ancillary, _, (host, port) = self._socket.recvmsg(
                LONGEST_PACKET, ANCILLARY_BYTES
            )
        except OSError:
            return None  # `select` announced the packet, but its checksum was wrong
        if host != self._peer[0] or self._peer_port not in (None, port):
            self.foreign += 1
            self.stranger = Address(host, port)
            return None
        try:
            return self._unpack(packet), read_arrival_ns(ancillary)
        except BadInputError:
            self.malformed += 1
            return None


def bind_socket(listen: Address, kind: socket.SocketKind) -> socket.socket:
    """Return a non-blocking socket bound to an address; a stream socket listens already.

    Raises BadInputError when the address cannot be used.
    """
    opened = socket.socket(socket.AF_INET, kind)
    opened.setblocking(False)
    try:
        if kind == socket.SOCK_STREAM:  # earlier connections must not keep the address in use
            opened.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        opened.bind((resolve_host(listen), listen.port))
        if kind == socket.SOCK_STREAM:
            opened.listen()
    except (OSError, BadInputError) as error:
        opened.close()
        if isinstance(error, BadInputError):
            raise
        raise BadInputError(
            f"cannot listen on {listen}: {error.strerror}; "
            "choose another address, or stop what uses this one"
        ) from error
    return opened


def resolve_host(address: Address) -> str:
    """Return the number of an address's host; raise BadInputError for an unknown host."""
    try:
        return socket.gethostbyname(address.host)
    except (OSError, UnicodeError) as error:
        raise BadInputError(
            f"expected a host name or IPv4 address, found {address.host!r}, which nobody knows"
        ) from error
