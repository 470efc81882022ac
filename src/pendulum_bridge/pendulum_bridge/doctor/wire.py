"""The doctor's wire to a rig: packets as they come, malformed packets included."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from pendulum_bridge.driver.last_word import LastWord, SharedLink, describe_left_pwm
from pendulum_bridge.wire.protocol import SAMPLE, Command
from pendulum_bridge.wire.tcp import TcpPort
from pendulum_bridge.wire.udp import Address, Endpoint
from pendulum_twin.errors import BadInputError


@dataclass(frozen=True)
class Heard:
    """Hold a packet.

    at_s: when it reached this machine, on the wire's clock.
    """

    packet: bytes
    at_s: float


class Wire(Protocol):
    """Carry commands to a rig and packets back, with its own clock in s."""

    def now(self) -> float:
        """Return the time."""
        ...

    def send(self, command: Command) -> None:
        """Send a command; raise BadInputError when the network refuses."""
        ...

    def receive(self, deadline: float) -> Heard | None:
        """Return the oldest packet that was not yet returned; None at the deadline."""
        ...

    @property
    def foreign(self) -> int:
        """Return how many packets have come from other hosts than the rig's."""
        ...

    @property
    def stranger(self) -> Address | None:
        """Return who sent the last of them."""
        ...

    @property
    def trouble(self) -> str:
        """Return why the rig is not connected; empty while it is, and always over UDP."""
        ...


class Packets(SharedLink, Protocol):
    """A port that carries packets as they come: `Endpoint` or `TcpPort`."""

    foreign: int

    @property
    def trouble(self) -> str:
        """Return why the rig is not connected; empty while it is."""
        ...

    def send(self, packet: bytes) -> None:
        """Send a packet."""
        ...

    def receive_stamped(self, deadline: float) -> tuple[bytes, int] | None:
        """Return the oldest packet and its time (system clock, ns); None at the deadline."""
        ...

    def close(self) -> None:
        """Give the address back."""
        ...


class PortWire:
    """Exchange packets with a rig over UDP or TCP; the clock is monotonic. Close it after use.

    stranger: returns the sender of the last foreign packet.
    """

    def __init__(
        self, port: Packets, stranger: Callable[[], Address | None] = lambda: None
    ) -> None:
        self._port, self._stranger = port, stranger
        self._last_word: LastWord | None = None
        self._fault, self._out_pwm = "", 0.0  # what went out last

    def keep_last_word(self) -> None:
        """Have a companion process send PWM 0 in case this process is killed or stopped.

        Raises BadInputError when the companion does not get ready.
        """
        self._last_word = self._last_word or LastWord(self._port, Command(0.0).pack())

    def now(self) -> float:
        """Return the monotonic time."""
        return time.monotonic()

    def send(self, command: Command) -> None:
        """Send a command; raise BadInputError when it cannot be done."""
        if command.pwm and self._last_word is not None and not self._last_word.running:
            raise BadInputError(
                "expected a process that sends PWM 0 when the doctor is killed, found that it has "
                "ended or does not answer: examine the rig again"
            )
        try:
            self._port.send(command.pack())
        except BadInputError as error:
            self._fault = str(error)
            raise
        self._out_pwm = command.pwm

    def receive(self, deadline: float) -> Heard | None:
        """Return the oldest packet of the rig's host, whatever it holds; None at the deadline."""
        stamped = self._port.receive_stamped(deadline)
        if self._last_word is not None:
            self._last_word.alive()
        if stamped is None:
            return None
        packet, system_ns = stamped
        return Heard(packet, _convert_to_monotonic(system_ns))

    @property
    def foreign(self) -> int:
        """Return how many packets of other hosts were dropped."""
        return self._port.foreign

    @property
    def stranger(self) -> Address | None:
        """Return who sent the last of them."""
        return self._stranger()

    @property
    def trouble(self) -> str:
        """Return why the rig is not connected; empty while it is."""
        return self._port.trouble

    def close(self) -> None:
        """Give the address back.

        Raises BadInputError when the rig may hold a command, because no PWM 0 went out after it.
        """
        if self._last_word is not None:
            self._last_word.close(self._out_pwm)
        self._port.close()
        if self._out_pwm:
            raise BadInputError(describe_left_pwm(self._out_pwm, self._fault))


def open_udp_wire(listen: Address, rig: Address) -> PortWire:
    """Return a wire to a rig over UDP; raise BadInputError when `listen` cannot be used."""
    endpoint = Endpoint(listen, rig, bytes)
    return PortWire(endpoint, lambda: endpoint.stranger)


def open_tcp_wire(rig: Address) -> PortWire:
    """Return a wire to a rig that listens over TCP; a stream has no packets of wrong length."""
    return PortWire(TcpPort(rig, SAMPLE.size, bytes))


def _convert_to_monotonic(system_ns: int) -> float:
    """Return a time of the system's clock as a time of the monotonic clock, s."""
    return time.monotonic() - 1e-9 * (time.time_ns() - system_ns)
