"""A rig behind pipes: a real one, a silent one, a dead one, and one that never was."""

import sys
import time
from pathlib import Path

import numpy as np
import pytest
from support.polling import until

from pendulum_rl_env.process_transport import ProcessTransport
from pendulum_rl_env.transport import NoAnswerError
from pendulum_twin.errors import BadInputError

ECHO = """
import struct, sys
count = 0
while packet := sys.stdin.buffer.read(16):
    pwm, reset = struct.unpack(">dd", packet)
    count = 0 if reset else count + 1
    answer = struct.pack(">dddd", 3.0, pwm, count, reset)
    for part in (answer[:5], answer[5:]):
        sys.stdout.buffer.write(part)
        sys.stdout.buffer.flush()
"""
SILENT = """
import pathlib, sys
print("waits for Godot", file=sys.stderr, flush=True)
pathlib.Path(sys.argv[1]).touch()
sys.stdin.buffer.read()
"""
DEAD = "import sys; print('no sample'); print('no rig here\\n', file=sys.stderr); sys.exit(3)"


def start(source: str, *arguments: object, deadline_s: float = 120.0) -> ProcessTransport:
    command = [sys.executable, "-c", source, *map(str, arguments)]
    return ProcessTransport(command, 0.03, deadline_s)


def test_packets_are_put_in_the_order_of_a_state() -> None:
    transport = start(ECHO)
    first, second = transport.reset(), transport.exchange(0.25)
    assert (
        first.state.tolist() == [0.0, 3.0, 1.0, 0.0]
        and first.stamp_s == 0.0
        and first.info == {"dt_s": 0.0}
    )
    assert (
        second.state.tolist() == [1.0, 3.0, 0.0, 0.25]
        and second.stamp_s == 0.03
        and second.info == {"dt_s": 0.03}
    )
    transport.exchange(0.1)
    assert transport.reset().stamp_s == 0.0
    transport.close()
    transport.close()
    with pytest.raises(NoAnswerError, match="found it closed"):
        transport.exchange(0.0)


def test_a_silent_program_is_given_up_at_the_deadline_and_for_good(tmp_path: Path) -> None:
    started = tmp_path / "started"
    transport = start(SILENT, started, deadline_s=1.0)
    until(started.exists, "the program's start")
    begin_s = time.monotonic()
    with pytest.raises(NoAnswerError, match="expected a sample within 1 s, found none"):
        transport.reset()
    assert time.monotonic() - begin_s >= 1.0
    with pytest.raises(NoAnswerError, match="ended with status -9 and said last: waits for Godot"):
        transport.reset()
    transport.close()


def test_a_dead_programs_last_words_are_passed_on() -> None:
    transport = start(DEAD)
    with pytest.raises(NoAnswerError):
        for _ in range(2):  # its first line is no sample, and then it is gone
            transport.reset()
    with pytest.raises(NoAnswerError, match=r"ended with status 3 and said last: no rig here$"):
        transport.reset()
    transport.close()


def test_a_program_that_does_not_exist() -> None:
    with pytest.raises(
        BadInputError, match=r"expected the program \./no_such_rig, but it cannot be run"
    ):
        ProcessTransport(["./no_such_rig"], 0.03)


def test_a_real_rig_hangs_at_rest_and_is_pushed() -> None:
    transport = ProcessTransport(
        [sys.executable, "-m", "pendulum_bridge.stepped_rig", "--seed", "3"], 0.03, 120.0
    )
    assert transport.reset().state == pytest.approx(
        [0.0, np.pi, 0.0, 0.0], abs=0.2
    )  # an angle may be off
    before = transport.exchange(0.0).state
    after = [transport.exchange(0.5) for _ in range(10)][-1]
    assert abs(after.state[0] - before[0]) > 0.02 and after.stamp_s == pytest.approx(0.33)
    assert transport.reset().state[0] == pytest.approx(0.0, abs=1e-9)
    transport.close()
