"""However the driver's program ends, the last that the rig hears is PWM 0."""

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from unittest.mock import MagicMock

import pytest

rclpy = pytest.importorskip("rclpy")
from support.driven_rig import HOST, MODULE, RawRig, User, arguments_for  # noqa: E402
from support.ros_graph import DEADLINE_S, Graph, until  # noqa: E402
from support.running_emulator import TWIN  # noqa: E402

from pendulum_bridge.driver.driver import LAST_WORDS  # noqa: E402
from pendulum_bridge.wire.protocol import Command, Sample  # noqa: E402

HANGING = Sample(pole_rad=3.14159, pole_rate=0.0, cart_m=0.0, cart_velocity=0.0)
PARENT = f"""
import subprocess, sys
print(subprocess.Popen([sys.executable, "-m", "{MODULE}", *sys.argv[1:]]).pid, flush=True)
sys.stdin.read()
"""


class Bench:
    """A driver in a program of its own, a bare socket as its rig, and a user."""

    def __init__(self, ros: Graph) -> None:
        self.ros, self.rig, self.user = ros, RawRig(), User(ros)
        self.heard: list[Command] = []

    def step(self) -> None:
        """Send a sample, and listen to all."""
        self.rig.send(HANGING)
        self.ros.spin()
        self.heard += self.rig.heard()

    def until(self, done: Callable[[], object], what: str) -> None:
        until(done, what, self.step)

    def drive(self, pwm: float) -> None:
        """Command until the rig hears it."""
        self.command(
            pwm,
            lambda: self.heard and self.heard[-1].pwm == self.user.pwm == pwm,
            f"a command of {pwm}",
        )

    def command(self, pwm: float, done: Callable[[], object], what: str) -> None:
        """Command until something is done."""

        def step() -> None:
            self.user.send(pwm)
            self.step()

        until(done, what, step)

    def listen(self) -> None:
        """Hear what is left."""
        self.heard += self.rig.heard()


@pytest.fixture
def bench(ros: Graph) -> Iterator[Bench]:
    made = Bench(ros)
    yield made
    made.rig.close()


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_ends_it_with_0_several_times_and_status_0(
    bench: Bench, number: signal.Signals
) -> None:
    driver = bench.ros.start(MODULE, *arguments_for(bench.rig))
    bench.drive(0.1)
    pending = bench.user.ask("reset")
    # A reset answers commands with 0; it hangs already, and the answer takes some samples more.
    bench.command(0.1, lambda: bench.user.pwm == 0.0, "the reset")
    driver.send_signal(number)
    said, complaints = driver.communicate(timeout=DEADLINE_S)
    bench.listen()
    assert driver.returncode == 0 and "Traceback" not in said + complaints
    assert [command.pwm for command in bench.heard[-LAST_WORDS:]] == [0.0] * LAST_WORDS
    bench.until(pending.done, "the answer of who still waited")
    assert pending.result().message


def test_it_ends_when_its_parent_has_ended(bench: Bench) -> None:
    arguments = [sys.executable, "-c", PARENT, *arguments_for(bench.rig)]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    with subprocess.Popen(arguments, env=bench.ros.environment, **pipes) as parent:
        driver = int(parent.stdout.readline())
        try:
            bench.drive(0.1)
            parent.kill()
            bench.until(lambda: not is_running(driver), "the end of the driver")
            bench.listen()
            assert [command.pwm for command in bench.heard[-LAST_WORDS:]] == [0.0] * LAST_WORDS
        finally:
            parent.kill()
            if is_running(driver):
                os.kill(driver, signal.SIGKILL)


def test_without_a_parent_to_end_with_only_a_signal_ends_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from pendulum_bridge.nodes import driver_node

    looked: list[bool] = []
    monkeypatch.setattr(driver_node, "Parent", lambda: looked.append(True))
    monkeypatch.setattr(driver_node, "SingleThreadedExecutor", MagicMock())
    stopped = threading.Event()
    stopped.set()
    for ends in (False, True):
        node = MagicMock(settings=MagicMock(end_with_parent=ends), waiting=0)
        driver_node.serve(node, stopped)
        node.finish.assert_called_once()
        assert bool(looked) is ends


def test_a_parent_that_ends_while_the_driver_starts_is_noticed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from pendulum_bridge.driver import parent
    from pendulum_bridge.nodes import driver_node

    numbers = [1000]
    monkeypatch.setattr(parent.os, "getppid", lambda: numbers[-1])
    monkeypatch.setattr(driver_node, "SingleThreadedExecutor", MagicMock())
    stopped = MagicMock()
    stopped.is_set.side_effect = [False, AssertionError("the end of the parent went unnoticed")]
    node = MagicMock(waiting=0, start=lambda: numbers.append(1))
    driver_node.serve(node, stopped)
    node.finish.assert_called_once()


def test_a_rig_that_may_hold_a_command_is_the_failure_of_the_program(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from pendulum_bridge.nodes import driver_node

    monkeypatch.setattr(driver_node, "SingleThreadedExecutor", MagicMock())
    stopped = threading.Event()
    stopped.set()
    for left, failure in (("the rig may hold PWM 0.2", "the rig may hold PWM 0.2"), ("", None)):
        assert driver_node.serve(MagicMock(waiting=0, left=left), stopped) == failure


def is_running(process: int) -> bool:
    try:
        with open(f"/proc/{process}/stat") as stat:
            return stat.read().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def test_what_cannot_run_ends_with_a_sentence(ros: Graph) -> None:
    driver = ros.start(MODULE, "--ros-args", "-p", f"twin:={TWIN}", "-p", "pwm_limit:=.nan")
    said, complaints = driver.communicate(timeout=DEADLINE_S)
    assert (driver.returncode, said) == (1, "")
    assert complaints == "driver_node: pwm_limit: expected a number from 0.001 to 1, found nan\n"


def test_a_taken_port_ends_it_with_a_sentence(bench: Bench) -> None:
    first = bench.ros.start(MODULE, *arguments_for(bench.rig))
    bench.until(lambda: bench.heard, "the first driver")
    second = bench.ros.start(MODULE, *arguments_for(bench.rig))
    _, complaints = second.communicate(timeout=DEADLINE_S)
    assert second.returncode == 1 and first.poll() is None
    assert f"driver_node: cannot listen on {HOST}:{bench.rig.listen_port}" in complaints
