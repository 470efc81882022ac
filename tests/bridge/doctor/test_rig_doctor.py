"""The program over real sockets: emulated rigs in processes, and bare sockets as rigs.

On a busy machine samples come unevenly and late: small faults of time decide nothing here.
Programs run side by side, to save time.
"""

import json
import math
import os
import signal
import struct
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from support.repeating import repeat_until_right
from support.running_emulator import LONG_S, TWIN, free_ports, start, udp_socket

from pendulum_bridge.doctor.driving import LAST_PACKETS
from pendulum_bridge.doctor.findings import Check
from pendulum_bridge.doctor.rig_doctor import NOTICE, parse_options
from pendulum_bridge.wire.protocol import Command, Sample
from pendulum_twin.model import Twin, load_twin, save_twin
from pendulum_twin.schemas import DOCTOR

BUSY = {"rate_off", "jitter", "bursts", "some_lost", "slow_answer"}
HANGING = Sample(math.pi, 0.0, 0.0, 0.0)
LONGEST_RUN_S = 600.0

Answer = tuple[int, dict, set[str]]


class Doctor:
    """A running `rig_doctor`."""

    def __init__(self, user: int, rig: int, *arguments: str | Path) -> None:
        addresses = ("--listen", f"127.0.0.1:{user}", "--rig", f"127.0.0.1:{rig}")
        command = [
            sys.executable,
            "-m",
            "pendulum_bridge.doctor.rig_doctor",
            "--twin",
            TWIN,
            *addresses,
            *arguments,
        ]
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
        self.process = subprocess.Popen(
            list(map(str, command)),
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def wait(self) -> tuple[int, str, str]:
        """Return exit status, what it said, and its complaints."""
        said, complaints = self.process.communicate(timeout=LONGEST_RUN_S)
        return self.process.returncode, said, complaints

    def answer(self) -> Answer:
        """Return exit status, JSON object, and its faults without those of a busy machine."""
        status, said, complaints = self.wait()
        assert complaints in ("", NOTICE + "\n")
        answer = json.loads(said)
        assert answer["schema"] == DOCTOR
        faults = {finding["fault"] for finding in answer["findings"]}
        return status, answer, faults - {None} - BUSY


class Rig:
    """An emulated rig in its own process, and the doctor that examines it when it is ready."""

    def __init__(self, *arguments: str | Path) -> None:
        self._tcp = ("--tcp",) if "--tcp" in arguments else ()
        self._rig, self._user = free_ports()
        way = () if self._tcp else ("--send", f"127.0.0.1:{self._user}")
        self._process = start(
            "--twin", TWIN, "--listen", f"127.0.0.1:{self._rig}", *way, *arguments
        )

    def examine(self, *arguments: str) -> Doctor:
        assert self._process.stdout is not None and "listens on" in self._process.stdout.readline()
        return Doctor(self._user, self._rig, "--json", *self._tcp, *arguments)

    def end(self) -> None:
        self._process.send_signal(signal.SIGTERM)
        self._process.communicate(timeout=LONG_S)


def examine_side_by_side(
    rig_arguments: list[list[str | Path]], expected: list[set[str]], *arguments: str
) -> list[Answer]:
    """Return the answers with the expected faults; repeat when the machine stood still."""

    def examine() -> list[Answer]:
        rigs = [Rig(*of_rig) for of_rig in rig_arguments]
        try:
            return [doctor.answer() for doctor in [rig.examine(*arguments) for rig in rigs]]
        finally:
            for rig in rigs:
                rig.end()

    return repeat_until_right(
        examine, lambda answers: [faults for _, _, faults in answers] == expected
    )


class BareRig:
    """A socket in a rig's place: sends a packet 100 times a second and keeps every command."""

    def __init__(self, packet: bytes, every: bytes | None = None, host: str = "127.0.0.1") -> None:
        self.commands: list[Command] = []
        self.listening, self._sending = udp_socket(), udp_socket()
        self.listening.bind(("127.0.0.1", 0))
        self.listening.setblocking(False)
        self._sending.bind((host, 0))
        self.port, (self.user,) = self.listening.getsockname()[1], free_ports(1)
        self._packet, self._stray, self.closing = packet, every, threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def __enter__(self) -> "BareRig":
        return self

    def __exit__(self, *_: object) -> None:
        self.closing.set()
        self._thread.join()
        self.listening.close()
        self._sending.close()

    def _run(self) -> None:
        sent, begin = 0, time.monotonic()
        while not self.closing.wait(max(begin + 0.01 * sent - time.monotonic(), 0.0)):
            sent += 1
            packet = self._stray if self._stray is not None and sent % 10 == 0 else self._packet
            self._sending.sendto(packet, ("127.0.0.1", self.user))
            self.drain()

    def drain(self) -> None:
        while True:
            try:
                self.commands.append(Command.unpack(self.listening.recv(100)))
            except BlockingIOError:
                return


def write_twin_file(folder: Path, name: str, effects: dict) -> Path:
    save_twin(Twin(name, load_twin(TWIN).rig, effects), folder / f"{name}.yaml")
    return folder / f"{name}.yaml"


@pytest.mark.long
def test_emulated_rigs_that_are_moved_are_found_as_they_are(tmp_path: Path) -> None:
    mirrored = write_twin_file(tmp_path, "mirrored", {"cart_sign_inverted": {}})
    answers = examine_side_by_side(
        [[], ["--twin", mirrored]], [set(), {"cart_mirrored"}], "--move", "--seconds", "1"
    )
    assert [status for status, _, _ in answers] == [0, 1]
    for _, answer, _ in answers:
        verdicts = [finding["verdict"] for finding in answer["findings"]]
        assert len(verdicts) == len(Check) and "SKIPPED" not in verdicts


def test_emulated_rigs_at_rest_are_found_as_they_are(tmp_path: Path) -> None:
    offset = write_twin_file(tmp_path, "offset", {"angle_offset": {"angle_rad": 0.1}})
    rigs = [["--twin", offset], ["--rate", "50"], ["--spikes", "0.05"], ["--tcp"]]
    answers = examine_side_by_side(
        rigs, [{"zero_off"}, {"rate_wrong"}, {"spikes"}, set()], "--seconds", "1"
    )
    assert [status for status, _, _ in answers] == [0, 1, 0, 0]


def test_what_a_bare_socket_sends_is_recognised() -> None:
    swapped = struct.pack("<dddd", math.pi, 0.0, 0.0, 0.0)

    def examine() -> list[tuple[BareRig, Answer]]:
        bares = [
            BareRig(swapped),
            BareRig(HANGING.pack(), every=b"hello"),
            BareRig(HANGING.pack(), host="127.0.0.2"),
        ]
        doctors = [Doctor(bare.user, bare.port, "--json", "--seconds", "1") for bare in bares]
        examined = []
        for doctor, bare in zip(doctors, bares, strict=True):
            with bare:
                examined.append((bare, doctor.answer()))
                bare.drain()
        return examined

    expected = [
        ({"bytes_swapped"}, 1, "big-endian"),
        ({"some_malformed"}, 0, "5 bytes of text ('hello')"),
        ({"all_foreign"}, 1, "another host (127.0.0.2), none of the rig"),
    ]
    right_faults = [faults for faults, _, _ in expected]
    examined = repeat_until_right(
        examine, lambda pairs: [faults for _, (_, _, faults) in pairs] == right_faults
    )
    for (bare, (status, answer, _)), (_, right_status, text) in zip(
        examined, expected, strict=True
    ):
        assert status == right_status and text in json.dumps(answer)
        assert set(bare.commands) == {Command(0.0)}, "without --move nothing but PWM 0 is sent"
        assert len(bare.commands) > LAST_PACKETS, "and that also at the end"


def test_an_interrupted_push_ends_with_pwm_0() -> None:
    numbers, bares = (signal.SIGINT, signal.SIGTERM), [BareRig(HANGING.pack()) for _ in range(2)]
    doctors = [Doctor(bare.user, bare.port, "--move", "--seconds", "1") for bare in bares]
    for bare, doctor, number in zip(bares, doctors, numbers, strict=True):
        with bare:
            while not any(command.pwm > 0.02 for command in bare.commands):
                assert doctor.process.poll() is None, doctor.wait()
                bare.closing.wait(0.01)
            doctor.process.send_signal(number)
            status, _, complaints = doctor.wait()
            bare.drain()
        assert (status, complaints) == (
            1,
            f"{NOTICE}\nrig_doctor: interrupted; the last that was sent is PWM 0\n",
        )
        assert bare.commands[-3:] == [Command(0.0)] * 3


def test_a_doctor_that_is_killed_leaves_pwm_0() -> None:
    with BareRig(HANGING.pack()) as bare:
        doctor = Doctor(bare.user, bare.port, "--move", "--seconds", "1")
        while not any(command.pwm > 0.02 for command in bare.commands):
            assert doctor.process.poll() is None, doctor.wait()
            bare.closing.wait(0.01)
        doctor.process.kill()
        doctor.wait()
        end_s = time.monotonic() + LONGEST_RUN_S
        while bare.commands[-1].pwm:
            assert time.monotonic() < end_s, "the rig holds the doctor's last command"
            bare.closing.wait(0.01)
    assert bare.commands[-1] == Command(0.0)


def test_nobody_there_is_said_with_what_to_do() -> None:
    rig, user, tcp = free_ports(3)
    over_udp, over_tcp = (
        Doctor(user, rig, "--seconds", "1"),
        Doctor(user, tcp, "--json", "--tcp", "--seconds", "1"),
    )
    status, said, complaints = over_udp.wait()
    assert (status, complaints) == (1, "")
    lines = said.splitlines()
    assert (
        lines[2].startswith("FAIL     ports, rig listens")
        and "Start the rig's program" in lines[2]
    )
    assert lines[3].startswith("FAIL     samples, arrive") and "firewall" in lines[3]
    assert lines[-1] == "rig_doctor: 2 OK, 0 WARN, 2 FAIL, 19 SKIPPED"
    skipped = lines[4:-2]
    assert len(skipped) == 19 and all(line.startswith("SKIPPED") for line in skipped)
    status, answer, faults = over_tcp.answer()
    assert (status, faults) == (1, {"not_connected"}) and "no connection" in json.dumps(answer)


@pytest.mark.parametrize("arguments", [["--json"], []], ids=["json", "lines"])
def test_a_reader_that_has_gone_is_no_traceback(arguments: list[str]) -> None:
    rig, user = free_ports()
    doctor = Doctor(user, rig, "--seconds", "1", *arguments)
    assert doctor.process.stdout is not None and doctor.process.stderr is not None
    doctor.process.stdout.close()
    assert doctor.process.stderr.read() == ""
    assert doctor.process.wait(LONGEST_RUN_S) == 1


def test_a_taken_port_is_said_and_the_rig_left_alone() -> None:
    with BareRig(HANGING.pack()) as bare, udp_socket() as other:
        other.bind(("127.0.0.1", bare.user))
        status, said, _ = Doctor(bare.user, bare.port, "--move").wait()
        bare.drain()
    assert status == 1 and f"(process {os.getpid()})" in said and "driver_node" in said
    assert bare.commands == [], "whoever has the port drives the rig"


@pytest.mark.parametrize(
    "arguments",
    [["--rate", "0"], ["--rig", "nowhere"], ["--seconds", "x"], ["--seconds", ""], ["--moves"]],
)
def test_wrong_use_ends_with_2(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        parse_options(arguments)
    assert ended.value.code == 2
    assert "rig_doctor: error" in capsys.readouterr().err


def test_a_twin_file_that_cannot_be_read_is_a_sentence() -> None:
    status, said, complaints = Doctor(1, 2, "--twin", "nowhere.yaml").wait()
    assert (status, said) == (1, "")
    assert (
        complaints.startswith("rig_doctor: nowhere.yaml: expected a twin file")
        and complaints.count("\n") == 1
    )
