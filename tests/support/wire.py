"""The wire between a driver and an emulated rig: it sees every packet, and may spoil samples."""

import select
import socket
import threading
import time
from bisect import bisect_left
from collections.abc import Callable
from dataclasses import dataclass

from pendulum_bridge.wire.protocol import Command
from pendulum_bridge.wire.receive_time import (
    ANCILLARY_BYTES,
    read_arrival_ns,
    request_arrival_times,
)
from support.running_emulator import free_ports, udp_socket

LOOPBACK = "127.0.0.1"
FOREIGN = "127.0.0.2"  # another host of the loopback network
LONGEST_WAIT_S = 0.02
Spoil = Callable[[bytes], list[bytes]]


@dataclass(frozen=True)
class Sent:
    """Hold a command as the rig got it, and its arrival at the rig's end (monotonic, s)."""

    at_s: float
    pwm: float
    reset: bool


def untouched(packet: bytes) -> list[bytes]:
    return [packet]


def system_less_monotonic_s() -> float:
    """Return the system's clock less the monotonic one, from the pair that was read fastest."""
    pairs = [(time.monotonic(), time.time(), time.monotonic()) for _ in range(20)]
    before, system, after = min(pairs, key=lambda entry: entry[2] - entry[0])
    return system - 0.5 * (before + after)


class Wire:
    """Pass packets on in both directions in a thread of its own.

    driver_port: where the driver listens; rig_port: where it sends to. emulator_port, user_port:
    where the emulator listens and sends to. spoil: what becomes of a sample; changed at any time.
    commands: all that went to the rig, with the kernel's times: this thread stands still while the
    test's own `publish` waits, which the middleware's shared memory makes it do for 1 s when a
    reader is stopped in the middle of a read (`docs/faults.md`).
    """

    def __init__(self) -> None:
        self.emulator_port, self.user_port, self.driver_port, self.rig_port = free_ports(4)
        self._from_emulator, self._from_driver, self._foreign = (
            udp_socket(),
            udp_socket(),
            udp_socket(),
        )
        self._from_emulator.bind((LOOPBACK, self.user_port))
        self._from_driver.bind((LOOPBACK, self.rig_port))
        request_arrival_times(self._from_driver)
        self._foreign.bind((FOREIGN, 0))
        self.commands: list[Sent] = []
        self.odd: list[bytes] = []  # packets of the driver that are no commands
        self.spoil: Spoil = untouched
        self._system_less_monotonic_s = system_less_monotonic_s()
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    @property
    def pwm(self) -> float:
        """Return the last command that the rig got."""
        return self.commands[-1].pwm if self.commands else 0.0

    def since(self, at_s: float) -> list[Sent]:
        """Return the commands that the rig has got since a time."""
        return self.commands[bisect_left(self.commands, at_s, key=lambda sent: sent.at_s) :]

    def send_foreign(self, packet: bytes) -> None:
        """Send to the driver from another host."""
        self._foreign.sendto(packet, (LOOPBACK, self.driver_port))

    def close(self) -> None:
        self._closing.set()
        self._thread.join()
        for entry in (self._from_emulator, self._from_driver, self._foreign):
            entry.close()

    def _run(self) -> None:
        both: list[socket.socket] = [self._from_emulator, self._from_driver]
        while not self._closing.is_set():
            for ready in select.select(both, [], [], LONGEST_WAIT_S)[0]:
                packet, ancillary, _, _ = ready.recvmsg(256, ANCILLARY_BYTES)
                if ready is self._from_driver:
                    self._to_rig(
                        packet, read_arrival_ns(ancillary) / 1e9 - self._system_less_monotonic_s
                    )
                else:
                    for entry in self.spoil(packet):
                        self._from_driver.sendto(entry, (LOOPBACK, self.driver_port))

    def _to_rig(self, packet: bytes, at_s: float) -> None:
        try:
            command = Command.unpack(packet)
        except Exception:
            self.odd.append(packet)
            return
        self.commands.append(Sent(at_s, command.pwm, command.reset))
        self._from_emulator.sendto(packet, (LOOPBACK, self.emulator_port))
