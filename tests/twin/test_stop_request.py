"""A stop is heard once, however often and fast its signals come."""

import os
import signal
import subprocess
import sys

import pytest

PROGRAM = """
from pendulum_twin.stop_request import catch_stop_signals
stopped = catch_stop_signals()
print("ready", flush=True)
while not stopped.is_set():
    pass
input()
"""


@pytest.mark.parametrize("first", [signal.SIGINT, signal.SIGTERM])
def test_a_flood_of_signals_stops_a_program_once(first: signal.Signals) -> None:
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    program = subprocess.Popen(
        [sys.executable, "-c", PROGRAM],
        env=environment,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert program.stdout.readline() == "ready\n"
        for _ in range(20_000):
            program.send_signal(first)
            program.send_signal(signal.SIGTERM)
        _, complaints = program.communicate("end\n", timeout=120)
    finally:
        program.kill()
        program.wait()
    assert (program.returncode, complaints) == (0, "")
