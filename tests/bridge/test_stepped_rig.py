"""The stepped rig: sample for sample the emulated rig, anew after a reset, and a sentence for what is no packet."""

import io
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from pendulum_bridge import stepped_rig
from pendulum_bridge.emulator.conceal import conceal_effects, draw_concealed
from pendulum_bridge.emulator.rig import EmulatedRig
from pendulum_bridge.emulator.seal import Concealed, write_seal
from pendulum_bridge.emulator.sensors import Encoders
from pendulum_bridge.wire.protocol import COMMAND, SAMPLE, Command
from pendulum_twin.rig import Rig

PWM = (0.3, -0.2, -0.4, 0.5, 0.1)


def answers(arguments: Sequence[str], commands: Sequence[Command]) -> np.ndarray:
    options = stepped_rig.parse_options(list(arguments))
    out = io.BytesIO()
    stepped_rig.serve(
        stepped_rig.make_rig_factory(options),
        options.samples,
        io.BytesIO(b"".join(each.pack() for each in commands)),
        out,
    )
    return np.array(list(SAMPLE.iter_unpack(out.getvalue())))[:, [2, 0, 3, 1]]


def in_process(
    concealed: Concealed, samples: int = 3, encoders: Encoders = Encoders(), rate_hz: float = 100.0
):
    rig = EmulatedRig(concealed, rate_hz, encoders)
    return np.array([[rig.step(pwm) for _ in range(samples)][-1] for pwm in PWM])


def ended(data: bytes, *arguments: str) -> subprocess.CompletedProcess[bytes]:
    command = [sys.executable, "-m", "pendulum_bridge.stepped_rig", *arguments]
    return subprocess.run(command, input=data, capture_output=True, timeout=60, check=False)


def test_a_seed_is_the_rig_that_the_emulator_draws(nominal: Rig) -> None:
    assert np.array_equal(
        answers(["--seed", "7"], [Command(u) for u in PWM]),
        in_process(draw_concealed(7, 1, nominal, live=True)),
    )


def test_a_seal_is_its_rig_measured_as_asked(nominal: Rig, tmp_path: Path) -> None:
    concealed = conceal_effects(("input_delay", "cart_coulomb_friction"), 4, nominal)
    write_seal(concealed, tmp_path / "seal.json")
    arguments = [
        "--seal",
        str(tmp_path / "seal.json"),
        "--pole-counts",
        "512",
        "--rate-hz",
        "50",
        "--samples",
        "2",
    ]
    assert np.array_equal(
        answers(arguments, [Command(u) for u in PWM]),
        in_process(concealed, 2, Encoders(pole_counts=512), 50.0),
    )


def test_a_reset_leaves_nothing_of_before(nominal: Rig, tmp_path: Path) -> None:
    write_seal(
        conceal_effects(("motor_lag", "velocity_filter"), 4, nominal), tmp_path / "seal.json"
    )
    commands = [Command(u) for u in PWM]
    found = answers(
        ["--seal", str(tmp_path / "seal.json")], [*commands, Command(0.5, reset=True), *commands]
    )
    assert found[len(PWM)] == pytest.approx([0.0, np.pi, 0.0, 0.0], abs=1e-9)
    assert np.array_equal(found[: len(PWM)], found[len(PWM) + 1 :])


def test_a_rig_obeys_from_its_reset_on_though_its_recording_began_stale(
    nominal: Rig, tmp_path: Path
) -> None:
    write_seal(conceal_effects(("stale_start",), 4, nominal), tmp_path / "seal.json")
    assert abs(answers(["--seal", str(tmp_path / "seal.json")], [Command(0.5)])[0, 2]) > 0.1


def test_the_program_answers_in_lockstep_and_ends_with_its_input() -> None:
    done = ended(b"".join(Command(u).pack() for u in PWM), "--seed", "7")
    assert (done.returncode, len(done.stdout), done.stderr) == (0, len(PWM) * SAMPLE.size, b"")


@pytest.mark.parametrize(
    "garbage", [b"garbage", COMMAND.pack(float("nan"), 0.0), COMMAND.pack(0.1, 7.0)]
)
def test_what_is_no_packet_ends_it_with_a_sentence(garbage: bytes) -> None:
    done = ended(Command(0.1).pack() + garbage, "--seed", "7")
    assert (done.returncode, len(done.stdout)) == (1, SAMPLE.size)
    assert (
        done.stderr.startswith(b"stepped_rig: command: expected") and done.stderr.count(b"\n") == 1
    )


def test_a_seal_that_is_none_is_a_sentence(tmp_path: Path) -> None:
    done = ended(b"", "--seal", str(tmp_path / "none.json"))
    assert (
        done.returncode == 1
        and b"expected a seal" in done.stderr
        and done.stderr.count(b"\n") == 1
    )


@pytest.mark.parametrize(
    "arguments",
    [
        "",
        "--seed x",
        "--seal a --seed 1",
        "--seal a --effects 2",
        "--seed 1 --samples 0",
        "--seed 1 --rate-hz 1e9",
    ],
)
def test_wrong_use(arguments: str) -> None:
    with pytest.raises(SystemExit) as end:
        stepped_rig.parse_options(arguments.split())
    assert end.value.code == 2
