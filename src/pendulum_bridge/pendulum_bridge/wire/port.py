"""The interface of what carries packets to a peer and back: the same over UDP and over TCP."""

from __future__ import annotations

from typing import Protocol


class Port[Packet](Protocol):
    """Send packets to a peer and receive the peer's packets.

    malformed: packets of the peer that could not be read; dropped.
    foreign: packets, or attempts to connect, of other senders; dropped.
    """

    malformed: int
    foreign: int

    def send(self, packet: bytes) -> None:
        """Send without blocking; raise BadInputError when the network refuses."""

    def receive(self, deadline: float) -> Packet | None:
        """Return the oldest unread packet, or None at the deadline (s, `time.monotonic`)."""

    def take_waiting(self) -> list[Packet]:
        """Return all unread packets, oldest first, without blocking."""

    def take_waiting_stamped(self) -> list[tuple[Packet, int]]:
        """Return all unread packets and their arrivals (ns, system clock), oldest first."""

    def close(self) -> None:
        """Free the address."""


class RigPort[Packet](Port[Packet], Protocol):
    """Be a port to the rig: packets have times, and a new connection may bring a new socket."""

    @property
    def connected(self) -> bool:
        """Whether packets can go out now; always, over UDP."""

    @property
    def trouble(self) -> str:
        """The reason in a sentence why the port is not connected; empty while it is."""

    @property
    def connections(self) -> int:
        """The number of connections so far: the socket is a new one whenever it has grown."""

    @property
    def peer(self) -> tuple[str, int] | None:
        """The address to send to (number, port); None when the socket itself knows it."""

    def fileno(self) -> int:
        """Return the socket's number; -1 while there is no socket."""

    def receive_stamped(self, deadline: float) -> tuple[Packet, int] | None:
        """Return the oldest unread packet and its arrival, or None at the deadline.

        The arrival is in ns of the system clock; the deadline in s of `time.monotonic`.
        """
