"""What carries packets to one peer and back, over UDP or TCP: whoever uses it need not know which."""

from __future__ import annotations

from typing import Protocol


class Port[Packet](Protocol):
    """Send packets to one peer and receive its packets.

    malformed: packets of the peer that hold nothing. foreign: packets, or attempts to connect, of
    somebody else; both are dropped and counted.
    """

    malformed: int
    foreign: int

    def send(self, packet: bytes) -> None:
        """Send, without waiting; raise BadInputError when it cannot be done."""

    def receive(self, deadline: float) -> Packet | None:
        """Return the oldest packet not yet seen, or None at the deadline (a time of `time.monotonic`, in s)."""

    def take_waiting(self) -> list[Packet]:
        """Return the packets that are there already, oldest first, without waiting."""

    def close(self) -> None:
        """Give the address back."""


class RigPort[Packet](Port[Packet], Protocol):
    """Be a port whose peer is the rig: its packets have times, and its socket may be another one after a break."""

    @property
    def connected(self) -> bool:
        """Tell whether packets can go out now; always, over UDP."""

    @property
    def trouble(self) -> str:
        """Return in a sentence why it is not connected; empty while it is."""

    @property
    def connections(self) -> int:
        """Return how many connections there have been: the socket is another one whenever this has grown."""

    @property
    def peer(self) -> tuple[str, int] | None:
        """Return where to send to (number and port), or None when the socket itself knows."""

    def fileno(self) -> int:
        """Return the socket's number, -1 while there is none."""

    def receive_stamped(self, deadline: float) -> tuple[Packet, int] | None:
        """Return the oldest packet and when it came (ns of the system's clock), or None at the deadline."""
