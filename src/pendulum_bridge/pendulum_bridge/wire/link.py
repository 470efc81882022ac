"""The link to a rig: a command goes out, a sample comes in before its deadline, and whatever goes wrong is counted."""

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

    received: samples handed out. lost: deadlines that passed without a sample. late: samples that
    came when nobody waited for them any more, dropped by `drop_waiting`. malformed: packets of the
    rig that hold no sample. foreign: packets of somebody else.
    """

    received: int = 0
    lost: int = 0
    late: int = 0
    malformed: int = 0
    foreign: int = 0


@dataclass(frozen=True)
class Arrival:
    """Hold a sample and when it reached this machine: arrival_ns by the system's clock, whoever slept meanwhile."""

    sample: Sample
    arrival_ns: int


class Link:
    """Talk to a rig, over UDP unless another port is given (`tcp.tcp_link` gives one over TCP).

    listen: where samples arrive; loopback unless an address elsewhere is given. rig: where
    commands go; only packets from its host are taken, with rig_port only from that port. port:
    used instead of these. Raises BadInputError when the address cannot be used. Close it after
    use, or use it in a `with`. One thread receives; any may send.
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
        """Give the address back; the rig holds its last command."""
        self._port.close()

    def fileno(self) -> int:
        """Return the socket's number, so that `select` and the like can wait for samples; -1 while there is none."""
        return self._port.fileno()

    @property
    def connected(self) -> bool:
        """Tell whether commands can go out now: always over UDP, over TCP while there is a connection."""
        return self._port.connected

    @property
    def trouble(self) -> str:
        """Return in a sentence why it is not connected, and what to do; empty while it is."""
        return self._port.trouble

    @property
    def connections(self) -> int:
        """Return how many connections there have been; 1 over UDP. When it grows, `fileno` gives another socket."""
        return self._port.connections

    @property
    def peer(self) -> tuple[str, int] | None:
        """Return where to send to (number and port), or None when the socket itself knows (TCP)."""
        return self._port.peer

    @property
    def counts(self) -> Counts:
        """Return what was counted so far."""
        return Counts(
            self._received, self._lost, self._late, self._port.malformed, self._port.foreign
        )

    def send(self, command: Command) -> None:
        """Send a command; raise BadInputError when the network refuses. Whether it arrives, only samples can tell."""
        self._port.send(command.pack())

    def receive(self, deadline: float) -> Sample | None:
        """Return the oldest sample not yet seen, or None at the deadline (a time of `time.monotonic`, in s)."""
        arrival = self.receive_stamped(deadline)
        return None if arrival is None else arrival.sample

    def receive_stamped(self, deadline: float) -> Arrival | None:
        """Return the same sample with the time at which it came. Over TCP this also connects anew, without holding up."""
        came = self._port.receive_stamped(deadline)
        if came is None:
            self._lost += 1
            return None
        self._received += 1
        return Arrival(*came)

    def drop_waiting(self) -> int:
        """Drop the samples that are there already, and return how many they were."""
        dropped = len(self._port.take_waiting())
        self._late += dropped
        return dropped

    def exchange(self, command: Command, timeout_s: float) -> Sample | None:
        """Send a command and return the first sample that comes after it, or None when timeout_s have passed.

        A sample from before the command is never taken for its answer.
        """
        self.drop_waiting()
        self.send(command)
        return self.receive(time.monotonic() + timeout_s)
