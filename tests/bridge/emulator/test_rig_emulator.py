"""The executable over real sockets: its samples are the engine's and come on time."""

import math
import re
import signal
import struct
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from threading import Event

import numpy as np
import pytest
from support.repeating import repeat_until_right
from support.running_emulator import LONG_S, TWIN, Emulator, free_ports, start, udp_socket

from pendulum_bridge.emulator.conceal import draw_concealed
from pendulum_bridge.emulator.rig import EmulatedRig
from pendulum_bridge.emulator.rig_emulator import parse_options, run
from pendulum_bridge.emulator.seal import Concealed, open_seal
from pendulum_bridge.wire.protocol import Command, Sample
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin, save_twin
from pendulum_twin.rig import Rig


@pytest.fixture
def emulated() -> Iterator[Callable[..., Emulator]]:
    running: list[Emulator] = []

    def make(*arguments: str | Path) -> Emulator:
        running.append(Emulator(*arguments))
        return running[-1]

    yield make
    for emulator in running:
        emulator.kill()


def get_sample(rig: EmulatedRig) -> Sample:
    x, th, v, w = rig.sample
    return Sample(pole_rad=th, pole_rate=w, cart_m=x, cart_velocity=v)


def test_lockstep_gives_the_engines_samples_bit_by_bit(
    emulated, tmp_path: Path, nominal: Rig
) -> None:
    emulator = emulated(
        "--lockstep", "--conceal", "7", "--effects", "2", "--seal", tmp_path / "seal.json"
    )
    assert "in lockstep" in emulator.ready
    concealed = open_seal(tmp_path / "seal.json")
    assert concealed == draw_concealed(7, 2, nominal, live=True)
    bare = EmulatedRig(concealed, seed=7)
    for k in range(300):
        pwm = 0.4 * math.cos(0.05 * k)
        bare.step(pwm)
        assert emulator.link.exchange(Command(pwm), LONG_S) == get_sample(bare), f"sample {k}"
    assert "300 samples sent, 300 commands taken, 0 malformed and 0 foreign" in emulator.end()


def test_in_real_time_an_answer_acts_from_its_sample_on(emulated, nominal: Rig) -> None:
    """An answer to another sample, or one that acts a sample later, gives another trajectory."""
    # again when this machine stood still for more than half a period, 50 ms
    samples, commands = repeat_until_right(
        lambda: exchange_in_time(emulated("--rate", "10")),
        lambda exchange: is_engines(*exchange, nominal),
    )
    assert not is_engines(samples, [0.0, *commands[:-1]], nominal)


def exchange_in_time(emulator: Emulator) -> tuple[list[Sample], list[float]]:
    """Return the first 20 samples of a rig at 10 Hz, and the command sent at once after each."""
    samples, commands = [], [0.2 * (-1) ** (k // 3) for k in range(20)]
    for pwm in commands:
        samples.append(emulator.receive())
        emulator.link.send(Command(pwm))
    emulator.kill()
    return samples, commands


def test_a_command_acts_by_its_arrival_however_late_the_emulator_reads_it(
    emulated, nominal: Rig
) -> None:
    """The emulator is stopped while two commands come: for this sample, and for the next."""
    expected = [0.0, 0.0, 0.3, -0.2, -0.2, -0.2, -0.2, -0.2]

    def exchange() -> list[Sample]:
        emulator = emulated("--rate", "10")
        samples = [emulator.receive() for _ in range(3)]
        began = time.monotonic()
        emulator.link.send(Command(0.3))
        emulator.process.send_signal(signal.SIGSTOP)
        assert emulator.link.receive(began + 0.08) is None  # the middle was 0.05 s after it
        emulator.link.send(Command(-0.2))
        emulator.process.send_signal(signal.SIGCONT)
        samples += [emulator.receive() for _ in range(5)]
        emulator.kill()
        return samples

    repeat_until_right(exchange, lambda samples: is_engines(samples, expected, nominal))


def is_engines(samples: list[Sample], commands: list[float], nominal: Rig) -> bool:
    """Return whether the engine gives the samples, each command held from its sample on."""
    bare = EmulatedRig(Concealed({}, nominal), rate_hz=10.0)
    for sample, pwm in zip(samples, commands, strict=True):
        if sample != get_sample(bare):
            return False
        bare.step(pwm)
    return True


def test_samples_come_on_time_and_do_not_drift(emulated) -> None:
    def is_on_time(times: np.ndarray) -> bool:
        period_s = float(np.median(np.diff(times)))
        return abs(times[-1] - times[0] - 2.0) < 0.1 and abs(period_s - 0.01) < 0.002

    repeat_until_right(lambda: list_arrivals(emulated("--rate", "100"), 201), is_on_time)


def test_it_can_run_faster_than_real_time(emulated) -> None:
    """500 samples last 5 s in real time, and 1 s at five times its speed."""
    repeat_until_right(
        lambda: list_arrivals(emulated("--speed", "5"), 501),
        lambda times: 0.9 < times[-1] - times[0] < 2.0,
    )


def list_arrivals(emulator: Emulator, count: int) -> np.ndarray:
    """Return when so many samples arrived, s, and end the emulator."""
    times = []
    for _ in range(count):
        emulator.receive()
        times.append(time.monotonic())
    emulator.kill()
    return np.array(times)


def test_the_last_command_is_held_and_reset_brings_it_to_rest(emulated) -> None:
    emulator = emulated("--lockstep")
    for k in range(60):
        emulator.link.exchange(Command(0.3 * (-1) ** (k // 20)), LONG_S)
    sample = emulator.link.exchange(Command(0.5, reset=True), LONG_S)
    assert abs(sample.pole_rad - math.pi) > 0.05
    for _ in range(1000):
        sample = emulator.link.exchange(Command(0.0, reset=True), LONG_S)
    assert (sample.pole_rad, sample.cart_m) == pytest.approx((math.pi, 0.0), abs=0.05)
    assert (sample.pole_rate, sample.cart_velocity) == pytest.approx((0.0, 0.0), abs=0.15)


def test_bad_packets_are_dropped_and_counted(emulated) -> None:
    emulator = emulated("--lockstep")
    where = (emulator.rig.host, emulator.rig.port)
    with udp_socket() as friend, udp_socket() as stranger:
        stranger.bind(("127.0.0.2", 0))
        for junk in (
            b"",
            b"short",
            bytes(32),
            struct.pack(">dd", math.nan, 0),
            struct.pack(">dd", 0.1, 0.5),
        ):
            friend.sendto(junk, where)
        stranger.sendto(Command(0.5).pack(), where)
    assert emulator.link.exchange(Command(0.0), LONG_S).cart_m == 0.0
    assert (
        "1 samples sent, 1 commands taken, 5 malformed and 1 foreign packets dropped"
        in emulator.end()
    )


def test_spikes_are_seen(emulated) -> None:
    emulator = emulated("--lockstep", "--spikes", "0.2")
    carts = [emulator.link.exchange(Command(0.0), LONG_S).cart_m for _ in range(200)]
    assert 20 < sum(abs(cart) > 0.04 for cart in carts) < 60


def test_the_effects_of_the_twin_file_are_emulated(emulated, tmp_path: Path, nominal: Rig) -> None:
    save_twin(Twin("backwards", nominal, {"input_sign_inverted": {}}), tmp_path / "twin.yaml")
    emulator = emulated("--lockstep", "--twin", tmp_path / "twin.yaml")
    for _ in range(10):
        sample = emulator.link.exchange(Command(0.3), LONG_S)
    assert sample.cart_m < -0.01


def test_a_signal_makes_it_the_other_rig(emulated, nominal: Rig, tmp_path: Path) -> None:
    file = tmp_path / "backwards.yaml"
    save_twin(Twin("backwards", nominal, {"input_sign_inverted": {}}), file)
    emulator = emulated("--lockstep", "--then", file)
    speeds = []
    for k in range(20):
        if k == 10:
            emulator.process.send_signal(signal.SIGUSR1)
        speeds.append(emulator.link.exchange(Command(0.3), LONG_S).cart_velocity)
    assert speeds[9] > speeds[4] > 0
    deadline = time.monotonic() + LONG_S
    while speeds[-1] >= speeds[-2] and time.monotonic() < deadline:
        speeds.append(emulator.link.exchange(Command(0.3), LONG_S).cart_velocity)
    assert speeds[-1] < speeds[-2], "the same command drives the other rig back"


def test_another_rig_that_cannot_be_emulated_is_refused_at_the_start(tmp_path: Path) -> None:
    file = tmp_path / "pole_only.yaml"
    file.write_text("schema: pendulum_twin/1\nname: pole\nrig: {pole_mass_kg: 0.1}\neffects: {}\n")
    process = start("--twin", TWIN, "--then", file)
    _, complaint = process.communicate(timeout=LONG_S)
    assert process.returncode == 1 and complaint.count("\n") == 1
    assert complaint.startswith("rig_emulator: ")


@pytest.mark.parametrize(
    ("number", "pace"), [(signal.SIGINT, "--lockstep"), (signal.SIGTERM, "--speed=1")]
)
def test_a_signal_ends_it_cleanly(emulated, number: signal.Signals, pace: str) -> None:
    assert re.fullmatch(
        r"rig_emulator: \d+ samples sent, 0 commands .*\n", emulated(pace).end(number)
    )


def test_a_second_signal_changes_nothing(emulated) -> None:
    running = emulated("--speed=1")
    deadline = time.monotonic() + LONG_S
    while running.process.poll() is None and time.monotonic() < deadline:  # until its very end
        running.process.send_signal(signal.SIGINT)
    assert running.process.poll() == 0


def test_it_ends_by_itself_after_seconds(emulated) -> None:
    assert "0 samples sent" in emulated("--seconds", "0.3", "--lockstep").ended()


def test_nobody_who_reads_its_lines_is_no_reason_to_end() -> None:
    rig, user = free_ports()
    process = start(
        "--twin",
        TWIN,
        "--listen",
        f"127.0.0.1:{rig}",
        "--send",
        f"127.0.0.1:{user}",
        "--seconds",
        "0.2",
    )
    process.stdout.close()
    assert process.stderr.read() == ""
    assert process.wait(LONG_S) == 0
    process.stderr.close()


def run_to_failure(*arguments: str | Path) -> tuple[int, str]:
    process = start(*arguments)
    _, said = process.communicate(timeout=LONG_S)
    assert "Traceback" not in said
    return process.returncode, said


def test_an_address_in_use_is_one_sentence() -> None:
    with udp_socket() as taken:
        taken.bind(("127.0.0.1", 0))
        address = f"127.0.0.1:{taken.getsockname()[1]}"
        status, said = run_to_failure("--twin", TWIN, "--listen", address)
    sentence = (
        f"rig_emulator: cannot listen on {address}: Address already in use; "
        "choose another address, or stop what uses"
    )
    assert status == 1 and said.startswith(sentence) and said.count("\n") == 1


def test_a_wrong_file_is_one_sentence() -> None:
    status, said = run_to_failure("--twin", "/no/such.yaml")
    assert (
        status == 1
        and said.startswith("rig_emulator: /no/such.yaml: expected a twin file")
        and said.count("\n") == 1
    )


def test_what_cannot_be_emulated_is_refused(tmp_path: Path, nominal: Rig) -> None:
    free = ["--listen", f"127.0.0.1:{free_ports()[0]}"]
    (tmp_path / "file").write_text("")
    save_twin(
        Twin(
            "t",
            nominal,
            {
                "thesis_dead_zones": {
                    "force_n": 0.1,
                    "cart_velocity_m_s": 0.1,
                    "pole_velocity_rad_s": 1.5,
                }
            },
        ),
        tmp_path / "t.yaml",
    )
    for arguments, sentence in (
        (["--twin", tmp_path / "t.yaml"], "expected effects that can be emulated"),
        (["--twin", TWIN, "--seal", tmp_path / "file" / "seal.json"], "File exists"),
        (
            ["--twin", TWIN, "--conceal", "1", "--effects", "99"],
            "effects: expected a number from 0 to",
        ),
    ):
        with pytest.raises((BadInputError, OSError), match=sentence):
            run(parse_options([*map(str, arguments), *free]), Event())


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--rate", "nan"], "argument --rate: expected a number from 10 to 1000, found 'nan'"),
        (
            ["--speed", "fast"],
            "argument --speed: expected a number from 0.1 to 1000, found 'fast'",
        ),
        (["--speed", "2", "--lockstep"], "not allowed with argument"),
        (["--conceal", "-1"], "argument --conceal: expected"),
        (["--effects", "1"], "--effects: expected --conceal SEED with it"),
        (["--listen", "16384"], "argument --listen: expected HOST:PORT"),
        (["--tcp", "--send", "127.0.0.1:5"], "argument --send: not allowed with argument --tcp"),
    ],
)
def test_wrong_use_is_status_2(
    arguments: list[str], sentence: str, capsys: pytest.CaptureFixture
) -> None:
    with pytest.raises(SystemExit) as ended:
        parse_options(arguments)
    assert ended.value.code == 2
    assert sentence in capsys.readouterr().err
