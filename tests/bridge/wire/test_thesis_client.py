"""The emulator serves the thesis's own client library, and a stand-in for its sockets.

The library (`drl-platform` 0.1.5) is installed without its dependencies: it asks for gym 0.19.0,
which needs cloudpickle below 1.7 and cannot be built with a current setuptools. Of gym it only
wants a class to inherit from, which gymnasium gives.
"""

import importlib
import importlib.util
import math
import select
import socket
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from typing import Any

import gymnasium
import pytest
from support.running_emulator import LONG_S, TWIN, free_ports, start

LIBRARY = "DrlPlatform"


class StandIn:
    """Act as the library's UDP server: a socket a command, a thread for the latest payload."""

    def __init__(
        self, host: str, port: int, rig_host: str, rig_port: int, package_timeout: float
    ) -> None:
        self._rig, self._timeout_s = (rig_host, rig_port), package_timeout
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind((host, port))
        self._latest, self._arrived, self._closing = b"", threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._serve)

    def _serve(self) -> None:
        self._socket.settimeout(self._timeout_s)
        with self._socket:
            while not self._closing.is_set():
                try:
                    self._latest = self._socket.recv(4096)
                    self._arrived.set()
                except TimeoutError:
                    continue

    def start_server(self) -> None:
        self._thread.start()

    def close_server(self) -> None:
        self._closing.set()
        self._thread.join()

    def receive_payload(self, mask: str) -> list[float]:
        assert self._arrived.wait(LONG_S)
        payload = struct.unpack(mask, self._latest)
        self._arrived.clear()
        return list(payload)

    def send_payload(self, payload: tuple[float, ...], mask: str) -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            sender.sendto(struct.pack(mask, *payload), self._rig)


def the_library(monkeypatch: pytest.MonkeyPatch) -> Any:
    if importlib.util.find_spec("gym") is None:
        monkeypatch.setitem(sys.modules, "gym", gymnasium)
    return importlib.import_module(
        f"{LIBRARY}.EnvironmentServer.udp_environment_server"
    ).EnvironmentServer


@pytest.fixture(params=["stand-in", "library"])
def client(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """Return the client's server, started, with an emulator at its other end."""
    make = StandIn if request.param == "stand-in" else the_library(monkeypatch)
    rig, user = free_ports()
    addresses = ("--listen", f"127.0.0.1:{rig}", "--send", f"127.0.0.1:{user}")
    process = start("--twin", TWIN, "--speed", "4", *addresses)
    try:
        assert (
            select.select([process.stdout], [], [], LONG_S)[0]
            and "listens on" in process.stdout.readline()
        )
        server = make("127.0.0.1", user, "127.0.0.1", rig, package_timeout=0.5)
        server.start_server()
        yield server
        server.close_server()
    finally:
        end(process)


def end(process: subprocess.Popen) -> None:
    process.terminate()
    _, complaints = process.communicate(timeout=LONG_S)
    assert (process.returncode, complaints) == (0, "")


def find_swing(pole_rad: float) -> float:
    """Return the angle from hanging, rad: on a busy machine the pole may go over the top."""
    return math.remainder(pole_rad - math.pi, math.tau)


def test_a_reset_and_500_steps(client: Any) -> None:
    def step(pwm: float, reset: float) -> list[float]:
        client.send_payload((pwm, reset), ">dd")
        return client.receive_payload(">dddd")

    samples: list[list[float]] = []

    def bring_to_rest() -> bool:
        for _ in range(20):
            step(0.0, 0.0)
        still = 0
        for _ in range(2000):
            samples.append(step(0.0, 1.0))
            pole_rad, pole_rate, cart_m, cart_velocity = samples[-1]
            calm = abs(pole_rate) < 0.2 and abs(cart_velocity) < 0.05
            is_there = abs(find_swing(pole_rad)) < 0.05 and abs(cart_m) < 0.03
            still = still + 1 if calm and is_there else 0
            if still == 20:
                return True
        return False

    for _ in range(20):
        step(0.4, 0.0)  # out of the middle
    # on a busy machine the rig gives a reset up; a client lets go of it, and asks again
    deadline = time.monotonic() + LONG_S
    while not bring_to_rest():
        assert time.monotonic() < deadline, (
            f"no reset brought the pendulum to rest: {samples[-5:]}"
        )
    samples = [step(0.1 * (-1) ** (k // 15), 0.0) for k in range(500)]
    carts = [sample[2] for sample in samples]
    assert max(carts) - min(carts) > 0.02
    assert max(abs(find_swing(sample[0])) for sample in samples) > 0.03
    assert all(math.isfinite(value) for sample in samples for value in sample)
