"""The link to a rig: a command goes out, a sample comes in before its deadline, and whatever goes wrong is counted."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Self

from pendulum_bridge.protocol import Command, Sample
from pendulum_bridge.udp import RIG, USER, Address, Endpoint


@dataclass(frozen=True)
class Counts:
    """Count what a link has seen.

    received: samples handed out. lost: deadlines that passed without a sample. late: samples that came when nobody waited
    for them any more, dropped by `drop_waiting`. malformed: packets of the rig that hold no sample. foreign: packets of
    somebody else.
    """

    received: int = 0
    lost: int = 0
    late: int = 0
    malformed: int = 0
    foreign: int = 0


class Link:
    """Talk to a rig over UDP.

    listen: where samples arrive; loopback unless an address elsewhere is given. rig: where commands go; only packets from
    its host are taken, with rig_port only from that port. Raises BadInputError when the address cannot be used. Close it
    after use, or use it in a `with`.
    """

    def __init__(self, listen: Address = USER, rig: Address = RIG, rig_port: int | None = None) -> None:
        self._endpoint = Endpoint(listen, rig, Sample.unpack, rig_port)
        self._received = self._lost = self._late = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Give the address back; the rig holds its last command."""
        self._endpoint.close()

    @property
    def counts(self) -> Counts:
        """Return what was counted so far."""
        return Counts(self._received, self._lost, self._late, self._endpoint.malformed, self._endpoint.foreign)

    def send(self, command: Command) -> None:
        """Send a command; raise BadInputError when the network refuses. Whether it arrives, only samples can tell."""
        self._endpoint.send(command.pack())

    def receive(self, deadline: float) -> Sample | None:
        """Return the oldest sample not yet seen, or None at the deadline (a time of `time.monotonic`, in s)."""
        sample = self._endpoint.receive(deadline)
        if sample is None:
            self._lost += 1
        else:
            self._received += 1
        return sample

    def drop_waiting(self) -> int:
        """Drop the samples that are there already, and return how many they were."""
        dropped = len(self._endpoint.waiting())
        self._late += dropped
        return dropped

    def exchange(self, command: Command, timeout_s: float) -> Sample | None:
        """Send a command and return the first sample that comes after it, or None when timeout_s have passed.

        A sample from before the command is never taken for its answer.
        """
        self.drop_waiting()
        self.send(command)
        return self.receive(time.monotonic() + timeout_s)
