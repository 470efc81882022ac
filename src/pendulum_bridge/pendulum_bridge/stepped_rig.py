"""An emulated rig that is stepped in lockstep over stdin and stdout, as fast as it goes.

It speaks the rig's own packets (see `wire.protocol`). Each command is held for --samples sample
periods and answered with the sample at their end. A command whose reset flag is 1 makes the rig
anew: it hangs at rest in the middle, drive and sensors remember nothing, and the answer is its
first sample. The end of stdin ends it. Run as
`python -m pendulum_bridge.stepped_rig --seal SEAL.json` for the rig of a trial.
"""

from __future__ import annotations

import argparse
import os
import signal
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import BinaryIO

from pendulum_bridge.emulator.conceal import count_families, draw_concealed
from pendulum_bridge.emulator.rig import EmulatedRig
from pendulum_bridge.emulator.seal import Concealed, open_seal
from pendulum_bridge.emulator.sensors import Encoders
from pendulum_bridge.wire.protocol import COMMAND, Command, Sample
from pendulum_twin.arrays import Floats
from pendulum_twin.command_line import add_version, make_number_reader, make_whole_reader
from pendulum_twin.errors import BadInputError
from pendulum_twin.inteco import DEFAULT, load_twin_or_inteco
from pendulum_twin.model import Twin
from pendulum_twin.parser import Parser, complete


def main(arguments: list[str] | None = None) -> int:
    """Answer commands until stdin ends and return 0; return 1 with a sentence on stderr if not."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    options = parse_options(arguments)
    try:
        with claim_stdout() as answers:
            serve(make_rig_factory(options), options.samples, sys.stdin.buffer, answers)
    except BrokenPipeError:  # the reader has gone
        return 0
    except (BadInputError, OSError) as error:
        print(f"stepped_rig: {error}", file=sys.stderr)
        return 1
    return 0


def serve(
    make_rig: Callable[[], EmulatedRig], samples: int, commands: BinaryIO, answers: BinaryIO
) -> None:
    """Answer each command with the sample after so many sample periods, until commands end.

    make_rig: returns the rig as it is after a reset.
    samples: sample periods that a command is held.
    Raises BadInputError for a packet that is no command.
    """
    rig = make_rig()
    while packet := commands.read(COMMAND.size):
        command = Command.unpack(packet)
        if command.reset:
            rig = make_rig()
        else:
            for _ in range(samples):
                rig.step(command.pwm)
        answers.write(_make_sample(rig.sample).pack())


def _make_sample(measured: Floats) -> Sample:
    cart_m, pole_rad, cart_velocity, pole_rate = measured.tolist()
    return Sample(pole_rad, pole_rate, cart_m, cart_velocity)


def claim_stdout() -> BinaryIO:
    """Return stdout, unbuffered, for packets alone; other output goes to stderr from now on."""
    stdout = os.fdopen(os.dup(sys.stdout.fileno()), "wb", buffering=0)
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    return stdout


def make_rig_factory(options: argparse.Namespace) -> Callable[[], EmulatedRig]:
    """Return the function that makes the rig of the options anew.

    Raises BadInputError when there is no such rig.
    """
    concealed = _choose_concealed(options)
    encoders = Encoders(options.pole_counts)

    def make_rig() -> EmulatedRig:
        return EmulatedRig(concealed, options.rate_hz, encoders, options.seed or 0)

    return make_rig


def _choose_concealed(options: argparse.Namespace) -> Concealed:
    """Return the truth of the rig, as effects that belong to one recording leave it."""
    if options.seal is None:
        nominal = load_twin_or_inteco(options.twin).rig
        return draw_concealed(options.seed, options.effects, nominal, live=True)
    sealed = open_seal(options.seal)
    lasting = Twin("sealed", sealed.rig, sealed.effects).drop_recording_effects()
    return replace(sealed, rig=lasting.rig, effects=lasting.effects)


def parse_options(arguments: list[str] | None) -> argparse.Namespace:
    """Return the command line's options; print the mistake and exit with 2 for wrong use."""
    parser = Parser(
        prog="stepped_rig",
        description=__doc__,
        examples=(
            "python -m pendulum_bridge.stepped_rig --seed 13 --effects 2",
            "python -m pendulum_bridge.stepped_rig --seal out/demo/seal.json",
        ),
    )
    add_version(parser)
    add = parser.add_argument
    which = parser.add_mutually_exclusive_group(required=True)
    which.add_argument(
        "--seal", type=Path, metavar="FILE", help="the rig that this seal holds, such as a trial's"
    )
    which.add_argument(
        "--seed", type=make_whole_reader(0), metavar="S", help="the rig that this seed draws"
    )
    add(
        "--effects",
        type=make_whole_reader(0, count_families(live=True)),
        metavar="N",
        help="how many effects the seed conceals (default: 1)",
    )
    add(
        "--twin",
        type=Path,
        help=f"nominal rig of --seed {DEFAULT}",
    )
    add(
        "--pole-counts",
        type=make_whole_reader(0, 10**9),
        default=4096,
        metavar="N",
        help="counts of the pole's encoder a turn",
    )
    add(
        "--rate-hz",
        type=make_number_reader(10, 1000),
        default=100.0,
        metavar="HZ",
        help="samples a second",
    )
    add(
        "--samples",
        type=make_whole_reader(1, 10**9),
        default=3,
        metavar="N",
        help="sample periods that a command is held",
    )
    complete(parser)
    options = parser.parse_args(arguments)
    if options.effects is not None and options.seed is None:
        parser.error("--effects: expected --seed with it: a seal says itself what is concealed")
    options.effects = 1 if options.effects is None else options.effects
    return options


if __name__ == "__main__":
    sys.exit(main())
