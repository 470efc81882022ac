"""A test run that was started under `nohup` can still interrupt the programs that it starts."""

import os
import signal
import subprocess
import sys

import pytest

PARENT = """
import signal, subprocess, sys
from support.signals import restore_interrupt
signal.signal(signal.SIGINT, signal.SIG_IGN)
if sys.argv[1] == "restored":
    restore_interrupt()
child = subprocess.Popen([sys.executable, "-c", "print('runs', flush=True); input()"],
                         stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
child.stdout.readline()
child.send_signal(signal.SIGINT)
print(child.wait() if sys.argv[1] == "restored" else child.poll())
child.kill()
"""


@pytest.mark.parametrize(
    ("way", "status"), [("restored", str(-signal.SIGINT)), ("ignored", "None")]
)
def test_a_parent_that_ignores_sigint(way: str, status: str) -> None:
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-c", PARENT, way]
    ended = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=300)
    assert (ended.stdout.strip(), ended.returncode) == (status, 0), ended.stderr


def test_this_run_does_not_ignore_sigint() -> None:
    assert signal.getsignal(signal.SIGINT) is not signal.SIG_IGN
