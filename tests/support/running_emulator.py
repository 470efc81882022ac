"""Start `rig_emulator` on free ports, speak with it, and end it."""

import os
import select
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

from pendulum_bridge.wire.link import Link
from pendulum_bridge.wire.protocol import Sample
from pendulum_bridge.wire.tcp import open_tcp_link
from pendulum_bridge.wire.udp import Address

TWIN = Path(__file__).parents[2] / "config" / "inteco.yaml"
LONG_S = 120.0


def udp_socket() -> socket.socket:
    return socket.socket(socket.AF_INET, socket.SOCK_DGRAM)


def free_ports(count: int = 2, kind: socket.SocketKind = socket.SOCK_DGRAM) -> list[int]:
    probes = [socket.socket(socket.AF_INET, kind) for _ in range(count)]
    for probe in probes:
        probe.bind(("127.0.0.1", 0))
    ports = [probe.getsockname()[1] for probe in probes]
    for probe in probes:
        probe.close()
    return ports


class Emulator:
    """A running `rig_emulator` on free ports, over UDP or TCP, and the link to it."""

    def __init__(self, *arguments: str | Path, tcp: bool = False) -> None:
        kind = socket.SOCK_STREAM if tcp else socket.SOCK_DGRAM
        self.rig, user = (Address("127.0.0.1", port) for port in free_ports(kind=kind))
        self.link = open_tcp_link(self.rig) if tcp else Link(user, self.rig)
        way = ["--tcp"] if tcp else ["--send", str(user)]
        self.process = start("--twin", TWIN, "--listen", str(self.rig), *way, *arguments)
        try:
            assert select.select([self.process.stdout], [], [], LONG_S)[0], (
                "it never said that it is ready"
            )
            self.ready = self.process.stdout.readline()
            assert "listens on" in self.ready, self.process.communicate(timeout=LONG_S)
        except BaseException:
            self.kill()
            raise

    def receive(self) -> Sample:
        sample = self.link.receive(time.monotonic() + LONG_S)
        assert sample is not None, f"no sample within {LONG_S} s"
        return sample

    def end(self, number: signal.Signals = signal.SIGTERM) -> str:
        """Signal it, check that it ends well, and return its last words."""
        self.process.send_signal(number)
        return self.ended()

    def ended(self) -> str:
        said, complaints = self.process.communicate(timeout=LONG_S)
        assert (self.process.returncode, complaints) == (0, "")
        return said

    def kill(self) -> None:
        self.link.close()
        self.process.kill()
        self.process.communicate()


def start(*arguments: str | Path) -> subprocess.Popen:
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-m", "pendulum_bridge.emulator.rig_emulator", *map(str, arguments)]
    return subprocess.Popen(
        command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
