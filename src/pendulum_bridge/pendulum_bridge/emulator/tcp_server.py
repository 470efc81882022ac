"""The rig's end of TCP: it listens, takes one connection at a time, and outlives it."""

from __future__ import annotations

import select
import socket
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Self

from pendulum_bridge.wire.stream import Stream
from pendulum_bridge.wire.udp import MOST_PACKETS_AT_ONCE, Address, bind_socket
from pendulum_twin.errors import BadInputError


class TcpServer[Packet]:
    """Exchange packets with whoever is connected.

    listen: where to wait for a connection. size: bytes of a packet that comes in. unpack: bytes to
    packet, raising BadInputError for what is none. While one is connected, another is turned away
    and counted as foreign; what is sent while nobody is connected is lost. Raises BadInputError
    when the address cannot be used.
    """

    def __init__(self, listen: Address, size: int, unpack: Callable[[bytes], Packet]) -> None:
        self._listener = bind_socket(listen, socket.SOCK_STREAM)
        self._size, self._unpack = size, unpack
        self._stream: Stream | None = None
        self.malformed = self.foreign = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the connection and give the address back."""
        self._drop()
        self._listener.close()

    def send(self, packet: bytes) -> None:
        """Send to whoever is connected."""
        try:
            if self._stream is not None:
                self._stream.send(packet)
        except OSError:
            self._drop()

    def receive(self, deadline: float) -> Packet | None:
        """Return the next packet, or None at the deadline (a time of `time.monotonic`, in s)."""
        while True:
            if (came := self._next()) is not None:
                return came[0]
            self._greet()
            if (left := deadline - time.monotonic()) <= 0:
                return None
            sources = [
                source.fileno() for source in (self._listener, self._stream) if source is not None
            ]
            select.select(sources, [], [], left)

    def take_waiting(self) -> list[Packet]:
        """Return the packets that are there already, oldest first, without waiting."""
        return [packet for packet, _ in self.take_waiting_stamped()]

    def take_waiting_stamped(self) -> list[tuple[Packet, int]]:
        """Return these packets and their arrivals (ns, system clock)."""
        packets: list[tuple[Packet, int]] = []
        while len(packets) < MOST_PACKETS_AT_ONCE and (came := self._next()) is not None:
            packets.append(came)
        self._greet()  # only now: who has just left makes room for who has just come
        return packets

    def _next(self) -> tuple[Packet, int] | None:
        for _ in range(MOST_PACKETS_AT_ONCE):
            try:
                came = None if self._stream is None else self._stream.take_frame()
            except OSError:
                self._drop()
                return None
            if came is None:
                return None
            try:
                return self._unpack(came[0]), came[1]
            except BadInputError:
                self.malformed += 1
        return None

    def _greet(self) -> None:
        """Take a connection that waits, or turn it away."""
        with suppress(OSError):  # nobody waits, or who did has gone again
            connected, _ = self._listener.accept()
            if self._stream is None:
                self._stream = Stream(connected, self._size)
            else:
                self.foreign += 1
                connected.close()

    def _drop(self) -> None:
        if self._stream is not None:
            self._stream.close()
            self._stream = None
