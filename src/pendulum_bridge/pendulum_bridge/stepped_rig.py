"""An emulated rig that is stepped directly, in lockstep, over stdin and stdout: for whoever cares for the rig, not for time.

It speaks the rig's own packets (see `protocol`). Each command is held for --samples sample periods
and answered with the sample at their end. A command whose reset flag is 1 makes the rig anew: it
hangs at rest in the middle, nothing remembered by drive or sensors, and the answer is its first
sample. The end of stdin ends it. Run as `python -m pendulum_bridge.stepped_rig --seal SEAL.json`
for the rig of a trial.
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

from pendulum_bridge.emulator.conceal import BY_NAME, draw_concealed
from pendulum_bridge.emulator.rig import EmulatedRig, Floats
from pendulum_bridge.emulator.seal import Concealed, open_seal
from pendulum_bridge.emulator.sensors import Encoders
from pendulum_bridge.wire.protocol import COMMAND, Command, Sample
from pendulum_twin.command_line import make_number_reader, make_whole_reader
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import load_twin


def main(arguments: list[str] | None = None) -> int:
    """Answer commands until stdin ends and return 0; 1 with a sentence on stderr when it cannot go on."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    options = parse_options(arguments)
    try:
        with claim_stdout() as out:
            serve(make_rig_factory(options), options.samples, sys.stdin.buffer, out)
    except BrokenPipeError:  # nobody wants to know any more
        return 0
    except (BadInputError, OSError) as error:
        print(f"stepped_rig: {error}", file=sys.stderr)
        return 1
    return 0


def serve(
    make: Callable[[], EmulatedRig], samples: int, commands: BinaryIO, answers: BinaryIO
) -> None:
    """Answer each command with the sample after so many sample periods, until there are no more.

    make: returns the rig as it is after a reset. Raises BadInputError for a packet that is none.
    """
    rig = make()
    while packet := commands.read(COMMAND.size):
        command = Command.unpack(packet)
        if command.reset:
            rig = make()
        else:
            for _ in range(samples):
                rig.step(command.pwm)
        answers.write(_make_sample(rig.sample).pack())


def _make_sample(measured: Floats) -> Sample:
    cart_m, pole_rad, cart_velocity, pole_rate = measured.tolist()
    return Sample(pole_rad, pole_rate, cart_m, cart_velocity)


def claim_stdout() -> BinaryIO:
    """Return stdout, unbuffered; what anything else prints goes to stderr from now on: packets stay among themselves."""
    out = os.fdopen(os.dup(sys.stdout.fileno()), "wb", buffering=0)
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    return out


def make_rig_factory(options: argparse.Namespace) -> Callable[[], EmulatedRig]:
    """Return what makes the rig that the options ask for; raise BadInputError when there is none."""
    concealed = _choose_concealed(options)
    encoders = Encoders(options.pole_counts)

    def make() -> EmulatedRig:
        return EmulatedRig(concealed, options.rate_hz, encoders, options.seed or 0)

    return make


def _choose_concealed(options: argparse.Namespace) -> Concealed:
    """Return the truth but for a stale start: that is a recording's, and a rig obeys from its reset on."""
    if options.seal is None:
        return draw_concealed(
            options.seed, options.effects, load_twin(options.twin).rig, live=True
        )
    sealed = open_seal(options.seal)
    return replace(
        sealed,
        effects={name: values for name, values in sealed.effects.items() if name != "stale_start"},
    )


def parse_options(arguments: list[str] | None) -> argparse.Namespace:
    """Return the command line's options; print what is wrong and exit with 2 for wrong use."""
    parser = argparse.ArgumentParser(
        prog="stepped_rig", description=" ".join((__doc__ or "").split())
    )
    add = parser.add_argument
    which = parser.add_mutually_exclusive_group(required=True)
    which.add_argument(
        "--seal", type=Path, metavar="FILE", help="the rig that this seal holds, such as a trial's"
    )
    which.add_argument(
        "--seed", type=make_whole_reader(0), metavar="S", help="the rig that this seed draws"
    )
    families = len({each.family for each in BY_NAME.values() if each.live})
    add(
        "--effects",
        type=make_whole_reader(0, families),
        metavar="N",
        help="how many effects the seed conceals (1)",
    )
    add(
        "--twin",
        type=Path,
        default=Path("config/inteco.yaml"),
        help="nominal rig of --seed (config/inteco.yaml)",
    )
    add(
        "--pole-counts",
        type=make_whole_reader(0, 10**9),
        default=4096,
        metavar="N",
        help="the pole's encoder's counts a turn (4096)",
    )
    add(
        "--rate-hz",
        type=make_number_reader(10, 1000),
        default=100.0,
        metavar="HZ",
        help="samples a second (100)",
    )
    add(
        "--samples",
        type=make_whole_reader(1, 10**9),
        default=3,
        metavar="N",
        help="sample periods that a command is held (3)",
    )
    options = parser.parse_args(arguments)
    if options.effects is not None and options.seed is None:
        parser.error("--effects: expected --seed with it: a seal says itself what is concealed")
    options.effects = 1 if options.effects is None else options.effects
    return options


if __name__ == "__main__":
    sys.exit(main())
