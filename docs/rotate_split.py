"""Diagnose a recording for every rotation of the split: how far do names and errors depend on it?

Prints names and held-out errors, a line for each rotation.
"""

import sys
from collections.abc import Sequence

from program_options import make_parser

from pendulum_sysid.cleaning.clean import clean_recording
from pendulum_sysid.fitting import split
from pendulum_sysid.pipeline import diagnose
from pendulum_sysid.reading.bag import read_bag
from pendulum_twin.command_line import run_command
from pendulum_twin.model import load_twin


def rotate(bag: str, twin_file: str) -> None:
    """Print names and held-out errors, a line for each rotation."""
    recording, twin = clean_recording(read_bag(bag)), load_twin(twin_file)
    pattern = split.PATTERN
    for k in range(len(pattern)):
        split.PATTERN = pattern[k:] + pattern[:k]
        verdict = diagnose([recording], twin, lambda line: None).to_dict()
        errors = {
            name: error["after"]
            for name, error in verdict["fit"].items()
            if name.startswith("held_out_")
        }
        names = ", ".join(missing["effect"] for missing in verdict["missing_physics"])
        print(
            k,
            verdict["outcome"],
            {name: float(f"{value:.3g}") for name, value in errors.items()},
            names,
            flush=True,
        )


def main(arguments: Sequence[str] | None = None) -> int:
    """Diagnose what the command line says; return the exit status."""
    parser = make_parser("rotate_split", __doc__, "out/minute config/inteco.yaml")
    parser.add_argument("bag", metavar="BAG", help="the recording")
    parser.add_argument("twin", metavar="TWIN", help="twin file of the rig")
    given = parser.parse_args(arguments)
    return run_command("rotate_split", lambda: rotate(given.bag, given.twin), "nothing written")


if __name__ == "__main__":
    sys.exit(main())
