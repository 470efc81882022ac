"""Real processes and sockets: whatever ends the driver, the rig hears PWM 0."""

import os
import select
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from pendulum_bridge.driver import companion, last_word_program
from pendulum_bridge.driver.companion import ANSWER_S, LONGEST_TURN_S, REPLACE_S
from pendulum_bridge.driver.last_word import LastWord
from pendulum_bridge.safety.reasons import Reason
from pendulum_bridge.wire.link import Link
from pendulum_bridge.wire.protocol import COMMAND, Command
from pendulum_bridge.wire.tcp import open_tcp_link
from pendulum_bridge.wire.udp import Address
from pendulum_twin.errors import BadInputError

LONG_S = 120.0
ZERO, DRIVEN = Command(0.0).pack(), Command(0.3).pack()

# A driver in small: it sends 0.3 every 10 ms and says that it is well. Arguments: udp or tcp, the
# rig's port, silence_s.
DRIVER = """
import select, signal, subprocess, sys, time
from pendulum_bridge.driver.last_word import LastWord
from pendulum_bridge.wire.link import Link
from pendulum_bridge.wire.protocol import Command
from pendulum_bridge.wire.tcp import open_tcp_link
from pendulum_bridge.wire.udp import Address
from pendulum_twin.errors import BadInputError

signal.signal(signal.SIGINT, signal.SIG_DFL)
rig, silence_s = Address("127.0.0.1", int(sys.argv[2])), float(sys.argv[3])
link = open_tcp_link(rig) if sys.argv[1] == "tcp" else Link(Address("127.0.0.1", 0), rig)
last = LastWord(link, Command(0.0).pack(), silence_s)
waits = [sys.executable, "-S", "-c", "import sys; sys.stdin.read()"]
other = subprocess.Popen(waits, close_fds=False)  # it waits for the end of the test's own pipe
print(last.pid, other.pid, "numpy" in sys.modules, flush=True)
while not select.select([sys.stdin], [], [], 0)[0]:
    try:
        link.send(Command(0.3))
    except BadInputError:
        pass
    link.receive(time.monotonic() + 0.01)
    last.alive()
"""


class Rig:
    """The rig's end of a link over UDP or TCP: it takes all commands in their order."""

    def __init__(self, way: str) -> None:
        self.way = way
        self.socket = socket.socket(
            socket.AF_INET, socket.SOCK_STREAM if way == "tcp" else socket.SOCK_DGRAM
        )
        self.socket.bind(("127.0.0.1", 0))
        if way == "tcp":
            self.socket.listen()
        self.listening = self.socket
        self.port = self.socket.getsockname()[1]

    def greet(self) -> None:
        if self.way == "tcp":
            self.listening.settimeout(LONG_S)
            self.socket, _ = self.listening.accept()

    def command(self, wait_s: float = LONG_S) -> bytes | None:
        """Return the next command, None for none; over TCP empty when the connection is closed."""
        if not select.select([self.socket], [], [], wait_s)[0]:
            return None
        return self.socket.recv(COMMAND.size)

    def until(self, wanted: bytes | None) -> float:
        """Take commands until one is the wanted; return how long that took, s."""
        begin = time.monotonic()
        while (command := self.command()) != wanted:
            assert command and time.monotonic() < begin + LONG_S, command
        return time.monotonic() - begin

    def drain(self) -> None:
        """Take all that has been sent so far."""
        while self.command(0):
            pass

    def close(self) -> None:
        self.socket.close()
        self.listening.close()


class Driver:
    """The small driver as a process of its own, and who belongs to it."""

    def __init__(self, rig: Rig, silence_s: float) -> None:
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
        arguments = [sys.executable, "-c", DRIVER, rig.way, str(rig.port), str(silence_s)]
        self.process = subprocess.Popen(
            arguments,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=environment,
            start_new_session=True,
        )
        rig.greet()
        self.companion, self.other, self.heavy = self.process.stdout.readline().split()
        rig.until(DRIVEN)

    def signal(self, number: signal.Signals) -> None:
        self.process.send_signal(number)

    def kill(self) -> None:
        self.process.kill()
        self.process.communicate()


@pytest.fixture
def driven() -> Iterator[Callable[..., tuple[Rig, Driver]]]:
    opened: list[Rig | Driver] = []

    def make(way: str = "udp", silence_s: float = 0.2) -> tuple[Rig, Driver]:
        rig = Rig(way)
        opened.append(rig)
        driver = Driver(rig, silence_s)
        opened.append(driver)
        return rig, driver

    yield make
    for resource in opened:
        resource.kill() if isinstance(resource, Driver) else resource.close()


def is_gone(pid: str) -> bool:
    """Tell whether a process has ended, whoever its parent is now and whether it has noticed."""
    try:
        return "\nState:\tZ" in Path(f"/proc/{pid}/status").read_text()
    except (FileNotFoundError, ProcessLookupError):
        return True


def wait_until(done: Callable[[], bool], limit_s: float = LONG_S) -> float:
    begin = time.monotonic()
    while not done():
        assert time.monotonic() < begin + limit_s, f"waited {limit_s} s"
    return time.monotonic() - begin


@pytest.mark.parametrize("way", ["udp", "tcp"])
def test_a_killed_driver_leaves_pwm_0(driven, way: str) -> None:
    """With a silence of a minute the closed pipe tells, though another child lives on."""
    rig, driver = driven(way, silence_s=60.0)
    driver.signal(signal.SIGKILL)
    took_s = rig.until(ZERO)
    assert not is_gone(driver.other) and driver.heavy == "False"
    for _ in range(last_word_program.LAST_WORDS - 1):
        assert rig.command() == ZERO
    gone_s = wait_until(lambda: is_gone(driver.companion))
    print(f"SIGKILL, {way}: PWM 0 after {1e3 * took_s:.1f} ms; gone {1e3 * gone_s:.0f} ms later")
    assert rig.command(0.05) in (None, b"")


@pytest.mark.wall_time
@pytest.mark.parametrize("way", ["udp", "tcp"])
def test_a_stopped_driver_leaves_pwm_0_and_is_watched_again_when_it_goes_on(
    driven, way: str
) -> None:
    rig, driver = driven(way)
    for _ in range(2):
        driver.signal(signal.SIGSTOP)
        took_s = rig.until(ZERO)
        assert took_s > 0.1
        print(f"SIGSTOP, {way}: PWM 0 after {1e3 * took_s:.0f} ms")
        assert [rig.command(), rig.command()] == [ZERO, ZERO]  # as long as it lasts
        driver.signal(signal.SIGCONT)
        rig.until(DRIVEN)
    driver.signal(signal.SIGKILL)
    rig.until(ZERO)
    wait_until(lambda: is_gone(driver.companion))


def test_signals_do_not_end_the_companion_before_the_driver(driven) -> None:
    rig, driver = driven(silence_s=60.0)
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        os.kill(int(driver.companion), number)
    os.killpg(driver.process.pid, signal.SIGINT)  # Ctrl-C: the driver dies of it, here
    rig.until(ZERO)
    wait_until(lambda: is_gone(driver.companion))


def test_after_another_connection_it_speaks_over_that_one(driven) -> None:
    rig, driver = driven("tcp", silence_s=60.0)
    rig.socket.close()
    rig.greet()
    rig.until(DRIVEN)
    rig.until(DRIVEN)  # after the first the driver has said that it is well once more
    driver.signal(signal.SIGKILL)
    rig.until(ZERO)


@pytest.fixture
def alone() -> Iterator[tuple[Rig, Link]]:
    rig = Rig("udp")
    with Link(Address("127.0.0.1", 0), Address("127.0.0.1", rig.port)) as link:
        yield rig, link
    rig.close()


def test_a_goodbye_is_silent_and_leaves_no_process(alone: tuple[Rig, Link]) -> None:
    rig, link = alone
    with LastWord(link, ZERO, silence_s=60.0) as word:
        assert word.running
        pid = str(word.pid)
        open_before = len(os.listdir("/proc/self/fd"))
    assert not word.running and not Path(f"/proc/{pid}").exists()
    assert len(os.listdir("/proc/self/fd")) < open_before
    word.close()
    word.alive()  # neither does anything now
    assert rig.command(0.1) is None


def test_left_with_a_command_at_the_rig_the_companion_speaks_and_ends(
    alone: tuple[Rig, Link],
) -> None:
    rig, link = alone
    with LastWord(link, ZERO, silence_s=60.0) as word:
        pid = str(word.pid)
        word.close(left_pwm=0.3)
        link.close()  # the companion has a socket of its own
        for _ in range(last_word_program.LAST_WORDS):
            assert rig.command() == ZERO
        wait_until(lambda: is_gone(pid))


@pytest.mark.parametrize(("refused", "heard"), [(0, 5), (40, 5), (10**6, 0)])
def test_packets_that_a_network_refuses_are_tried_again_for_a_while(
    refused: int, heard: int
) -> None:
    class WayOut:
        calls = 0

        def speak(self) -> bool:
            self.calls += 1
            return self.calls > refused

    way_out, begin = WayOut(), time.monotonic()
    last_word_program.say_last_words(way_out, patience_s=LONG_S if heard else 0.3)
    assert time.monotonic() - begin < LONG_S
    assert max(way_out.calls - refused, 0) == heard and way_out.calls > 1


def test_a_killed_companion_is_replaced(alone: tuple[Rig, Link]) -> None:
    rig, link = alone
    with LastWord(link, ZERO, silence_s=0.2) as word:
        lost = word.pid
        os.kill(lost, signal.SIGKILL)
        wait_until(lambda: not word.running)
        assert word.fault is Reason.NO_LAST_WORD
        word.alive()
        assert word.pid != lost
        wait_until(lambda: word.alive() or word.running)
        assert word.replaced == 1 and is_gone(str(lost)) and word.fault is None
        rig.until(ZERO)  # it has the socket, and speaks when it hears nothing


def beat(word: LastWord, clock_s: list[float], seconds: float) -> None:
    """Report that the driver works, a turn at a time, for so long on the test's clock."""
    for _ in range(round(seconds / LONGEST_TURN_S)):
        clock_s[0] += LONGEST_TURN_S
        word.alive()


def test_a_stopped_companion_counts_as_silent_soon_and_is_replaced_later(
    alone: tuple[Rig, Link],
) -> None:
    """It runs and would say nothing: that it does not answer tells."""
    rig, link = alone
    clock_s = [0.0]
    with LastWord(link, ZERO, silence_s=0.2, now=lambda: clock_s[0]) as word:
        lost = word.pid
        os.kill(lost, signal.SIGSTOP)
        beat(word, clock_s, 0.5 * ANSWER_S)
        assert word.running and word.fault is None  # not for want of a few answers
        beat(word, clock_s, 0.7 * ANSWER_S)
        assert not word.running and word.fault is Reason.LAST_WORD_SILENT
        assert word.pid == lost and word.replaced == 0
        beat(word, clock_s, REPLACE_S)
        assert word.pid != lost
        wait_until(lambda: word.alive() or word.running)
        assert word.replaced == 1 and is_gone(str(lost))
        rig.until(ZERO)


def test_a_companion_that_was_starved_speaks_as_soon_as_it_answers(
    alone: tuple[Rig, Link],
) -> None:
    _, link = alone
    clock_s = [0.0]
    with LastWord(link, ZERO, silence_s=60.0, now=lambda: clock_s[0]) as word:
        os.kill(word.pid, signal.SIGSTOP)
        beat(word, clock_s, 2.0 * ANSWER_S)
        assert word.fault is Reason.LAST_WORD_SILENT
        os.kill(word.pid, signal.SIGCONT)
        wait_until(lambda: word.alive() or word.running)
        assert word.replaced == 0 and word.fault is None


def test_a_computer_that_stands_still_silences_no_companion(alone: tuple[Rig, Link]) -> None:
    """Driver and companion stand still together; the driver may be the first to go on."""
    _, link = alone
    clock_s = [0.0]
    with LastWord(link, ZERO, silence_s=60.0, now=lambda: clock_s[0]) as word:
        os.kill(word.pid, signal.SIGSTOP)
        for _ in range(5):
            word.alive()
            clock_s[0] += 100.0
        word.alive()
        assert word.running and word.replaced == 0
        os.kill(word.pid, signal.SIGCONT)


def test_a_driver_that_stood_still_keeps_its_companion(alone: tuple[Rig, Link]) -> None:
    """The companion has answered; the driver was not there to hear it."""
    _, link = alone
    clock_s = [0.0]
    with LastWord(link, ZERO, silence_s=60.0, now=lambda: clock_s[0]) as word:
        for _ in range(3):
            word.alive()
            control = word._companion.control
            assert select.select([control], [], [], LONG_S)[0]
            clock_s[0] += 100.0
            word.alive()
        assert word.running and word.replaced == 0


def test_companions_that_die_at_once_are_not_started_in_a_loop(
    alone: tuple[Rig, Link], tmp_path: Path, monkeypatch
) -> None:
    _, link = alone
    clock_s = [0.0]
    with LastWord(link, ZERO, silence_s=60.0, now=lambda: clock_s[0]) as word:
        (tmp_path / "broken.py").write_text("raise SystemExit(1)")
        monkeypatch.setattr(companion, "PROGRAM", tmp_path / "broken.py")
        os.kill(word.pid, signal.SIGKILL)
        wait_until(lambda: not word.running)
        for turn in range(100):
            clock_s[0] = 0.02 * turn
            word.alive()
            assert not word.running
            wait_until(lambda: word._companion.process.poll() is not None)
        assert word.replaced == 2


@pytest.mark.wall_time
def test_a_stopped_companion_holds_nobody_up(alone: tuple[Rig, Link]) -> None:
    _, link = alone
    with LastWord(link, ZERO, silence_s=60.0) as word:
        os.kill(word.pid, signal.SIGSTOP)
        begin = time.monotonic()
        for _ in range(5000):
            word.alive()
        assert time.monotonic() - begin < 2.0
        os.kill(word.pid, signal.SIGCONT)


def test_without_a_connection_it_waits_for_one() -> None:
    rig = Rig("tcp")
    rig.listening.close()
    link = open_tcp_link(Address("127.0.0.1", rig.port))
    with LastWord(link, ZERO, silence_s=60.0) as word:
        assert word.running and not link.connected
    link.close()


def test_one_that_does_not_start_is_one_sentence(
    alone: tuple[Rig, Link], tmp_path: Path, monkeypatch
) -> None:
    (tmp_path / "broken.py").write_text("raise SystemExit(1)")
    monkeypatch.setattr(companion, "PROGRAM", tmp_path / "broken.py")
    with pytest.raises(
        BadInputError,
        match=r"last word: expected its process to be ready within 10 s: run .*broken\.py",
    ):
        LastWord(alone[1], ZERO)
