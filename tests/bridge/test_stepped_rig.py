"""The stepped rig equals the emulated rig sample for sample, and a reset makes it anew."""

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
ENCODERS = Encoders()
COMMANDS = [Command(pwm) for pwm in PWM]


def list_answers(arguments: Sequence[str], commands: Sequence[Command]) -> np.ndarray:
    """Return the samples that answer the commands, one a row: x, th, v, w."""
    options = stepped_rig.parse_options(list(arguments))
    answers = io.BytesIO()
    packets = io.BytesIO(b"".join(command.pack() for command in commands))
    stepped_rig.serve(stepped_rig.make_rig_factory(options), options.samples, packets, answers)
    return np.array(list(SAMPLE.iter_unpack(answers.getvalue())))[:, [2, 0, 3, 1]]


def step_in_process(
    concealed: Concealed, samples: int = 3, encoders: Encoders = ENCODERS, rate_hz: float = 100.0
) -> np.ndarray:
    rig = EmulatedRig(concealed, rate_hz, encoders)
    return np.array([[rig.step(pwm) for _ in range(samples)][-1] for pwm in PWM])


def run_program(data: bytes, *arguments: str) -> subprocess.CompletedProcess[bytes]:
    command = [sys.executable, "-m", "pendulum_bridge.stepped_rig", *arguments]
    return subprocess.run(command, input=data, capture_output=True, timeout=600, check=False)


def test_a_seed_is_the_rig_that_the_emulator_draws(nominal: Rig) -> None:
    assert np.array_equal(
        list_answers(["--seed", "7"], COMMANDS),
        step_in_process(draw_concealed(7, 1, nominal, live=True)),
    )


def test_a_seal_is_its_rig_measured_as_the_options_say(nominal: Rig, tmp_path: Path) -> None:
    concealed = conceal_effects(("input_delay", "cart_coulomb_friction"), 4, nominal)
    write_seal(concealed, tmp_path / "seal.json")
    options = ["--pole-counts", "512", "--rate-hz", "50", "--samples", "2"]
    assert np.array_equal(
        list_answers(["--seal", str(tmp_path / "seal.json"), *options], COMMANDS),
        step_in_process(concealed, 2, Encoders(pole_counts=512), 50.0),
    )


def test_a_reset_leaves_nothing_of_before(nominal: Rig, tmp_path: Path) -> None:
    concealed = conceal_effects(("motor_lag", "velocity_filter"), 4, nominal)
    write_seal(concealed, tmp_path / "seal.json")
    samples = list_answers(
        ["--seal", str(tmp_path / "seal.json")], [*COMMANDS, Command(0.5, reset=True), *COMMANDS]
    )
    assert samples[len(PWM)] == pytest.approx([0.0, np.pi, 0.0, 0.0], abs=1e-9)
    assert np.array_equal(samples[: len(PWM)], samples[len(PWM) + 1 :])


@pytest.mark.parametrize("effect", ["stale_start", "encoder_slip"])
def test_what_belongs_to_one_recording_is_not_the_rigs(
    effect: str, nominal: Rig, tmp_path: Path
) -> None:
    concealed = conceal_effects((effect, "motor_lag"), 4, nominal)
    write_seal(concealed, tmp_path / "seal.json")
    write_seal(
        Concealed({"motor_lag": concealed.effects["motor_lag"]}, concealed.rig),
        tmp_path / "lasting.json",
    )
    # longer than a slip may take to happen
    commands = [Command(0.5), *[Command(0.0)] * 20]
    options = ["--samples", "200"]
    samples, lasting = (
        list_answers(["--seal", str(tmp_path / name), *options], commands)
        for name in ("seal.json", "lasting.json")
    )
    assert np.array_equal(samples, lasting)


def test_the_program_answers_in_lockstep_and_ends_with_its_input() -> None:
    ended = run_program(b"".join(command.pack() for command in COMMANDS), "--seed", "7")
    assert (ended.returncode, len(ended.stdout)) == (0, len(PWM) * SAMPLE.size)
    assert ended.stderr == b""


@pytest.mark.parametrize(
    "garbage", [b"garbage", COMMAND.pack(float("nan"), 0.0), COMMAND.pack(0.1, 7.0)]
)
def test_a_packet_that_is_no_command_ends_it_with_a_sentence(garbage: bytes) -> None:
    ended = run_program(Command(0.1).pack() + garbage, "--seed", "7")
    assert (ended.returncode, len(ended.stdout)) == (1, SAMPLE.size)
    assert ended.stderr.startswith(b"stepped_rig: command: expected")
    assert ended.stderr.count(b"\n") == 1


def test_a_missing_seal_is_a_sentence(tmp_path: Path) -> None:
    ended = run_program(b"", "--seal", str(tmp_path / "none.json"))
    assert ended.returncode == 1 and b"expected a seal" in ended.stderr
    assert ended.stderr.count(b"\n") == 1


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
def test_wrong_use_ends_with_2(arguments: str) -> None:
    with pytest.raises(SystemExit) as ended:
        stepped_rig.parse_options(arguments.split())
    assert ended.value.code == 2
