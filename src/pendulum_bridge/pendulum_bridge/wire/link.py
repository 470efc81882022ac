"""The link to a rig: commands go out, samples come in before a deadline, errors are counted."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Self

from pendulum_bridge.wire.port import RigPort
from pendulum_bridge.wire.protocol import Command, Sample
from pendulum_bridge.wire.udp import RIG, USER, Address, Endpoint


@dataclass(frozen=True)
class Counts:
    """Count what a link has seen.

    received: samples that were returned.
    lost: deadlines that passed without a sample.
    late: samples that `drop_waiting` dropped because nobody waited for them any more.
    malformed: packets of the rig that hold no sample.
    foreign: packets of other senders.
    """

    received: int = 0
    lost: int = 0
    late: int = 0
    malformed: int = 0
    foreign: int = 0


@dataclass(frozen=True)
class Arrival:
    """Hold a sample and its time of arrival.

    sample: the sample.
    arrival_ns: ns, system clock; when the sample reached this machine, whichever process slept.
    """

    sample: Sample
    arrival_ns: int


class Link:
    """Talk to a rig over UDP, or over another port (`tcp.open_tcp_link` gives a link over TCP).

    One thread receives; any thread may send. Close the link after use, or use it in a `with`.

    listen: where samples arrive; loopback unless another address is given.
    rig: where commands go; packets are taken from this host only.
    rig_port: the only port of the rig that packets are taken from; None for any.
    port: the port to use instead of a UDP socket.

    Raises BadInputError when the address cannot be used.
    """

    def __init__(
        self,
        listen: Address = USER,
        rig: Address = RIG,
        rig_port: int | None = None,
        *,
        port: RigPort[Sample] | None = None,
    ) -> None:
        self._port: RigPort[Sample] = (
            Endpoint(listen, rig, Sample.unpack, rig_port) if port is None else port
        )
        self._received = self._lost = self._late = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Free the address; the rig holds its last command."""
        self._port.close()

    def fileno(self) -> int:
        """Return the socket's number for `select` and the like; -1 while there is no socket."""
        return self._port.fileno()

    @property
    def connected(self) -> bool:
        """Whether commands can go out: always over UDP, over TCP while there is a connection."""
        return self._port.connected

    @property
    def trouble(self) -> str:
        """Why the link is not connected, and what to do, in a sentence; empty while it is."""
        return self._port.trouble

    @property
    def connections(self) -> int:
        """The number of connections so far; 1 over UDP. `fileno` changes when it grows."""
        return self._port.connections

    @property
    def peer(self) -> tuple[str, int] | None:
        """The address to send to (number, port); None when the socket itself knows it (TCP)."""
        return self._port.peer

    @property
    def counts(self) -> Counts:
        """The counts so far."""
        return Counts(
            self._received, self._lost, self._late, self._port.malformed, self._port.foreign
        )

    def send(self, command: Command) -> None:
        """Send a command; only samples show whether it arrives.

        Raises BadInputError when the network refuses.
        """
        self._port.send(command.pack())

    def receive(self, deadline: float) -> Sample | None:
        """Return the oldest unread sample, or None at the deadline.

        deadline: s, `time.monotonic`.
        """
        arrival = self.receive_stamped(deadline)
        return None if arrival is None else arrival.sample

    def receive_stamped(self, deadline: float) -> Arrival | None:
        """Return the oldest unread sample with its time of arrival, or None at the deadline.

        Over TCP this also renews a broken connection, without blocking beyond the deadline.

        deadline: s, `time.monotonic`.
        """
        came = self._port.receive_stamped(deadline)
        if came is None:
            self._lost += 1
            return None
        self._received += 1
        return Arrival(*came)

    def take_waiting(self) -> list[Arrival]:
        """Return all unread samples with their times of arrival, oldest first, at once."""
        arrivals = [Arrival(*came) for came in self._port.take_waiting_stamped()]
        self._received += len(arrivals)
        return arrivals

    def drop_waiting(self) -> int:
        """Drop all unread samples, and return their number."""
        dropped = len(self._port.take_waiting())
        self._late += dropped
        return dropped

    def exchange(self, command: Command, timeout_s: float) -> Sample | None:
        """Send a command and return the first sample that comes after it, or None at the timeout.

        A sample from before the command is never taken for its answer.

        timeout_s: s, from the sending.
        """
        self.drop_waiting()
        self.send(command)
        return self.receive(time.monotonic() + timeout_s)
