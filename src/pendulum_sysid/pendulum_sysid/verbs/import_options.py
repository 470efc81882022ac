"""The options of `sysid import`."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from pendulum_sysid.verbs.shared_options import add_json, add_verb, read_above_zero, read_seconds

if TYPE_CHECKING:
    from pendulum_sysid.verbs.shared_options import Verbs

# as `reading.columns` has them, which reads the catalogue: that waits for --effects
COMMAND_UNITS = ("one", "percent", "per_mille")


def add_import(verbs: Verbs) -> None:
    """Add the verb `import`."""
    verb = add_verb(
        verbs,
        "import",
        "turn columns of a CSV, .mat, .npz or .parquet file, or a ROS 1 bag, into a recording",
    )
    verb.add_argument(
        "csv",
        type=Path,
        nargs="+",
        metavar="FILE",
        help="a file whose first line names its columns; without, give their numbers from 1",
    )
    out = "the rosbag2 folder to write; with several files, the folder of one for each"
    verb.add_argument("--out", required=True, type=Path, metavar="BAG", help=out)
    _add_columns(verb)
    _add_clock(verb)
    _add_command_times(verb)
    _add_units(verb)
    _add_changes(verb)
    add_json(verb)


def _add_columns(verb: argparse.ArgumentParser) -> None:
    """Add which columns hold what."""
    for option, what in (
        ("time", "time of each sample"),
        ("command", "what was sent to the drive"),
        ("cart", "cart position"),
        ("pole", "pole angle, counterclockwise"),
        ("cart-velocity", "reported velocity of the cart, in its unit a second"),
        ("pole-velocity", "reported rate of the pole, in its unit a second"),
        ("sin", "sine of the pole's angle, with --cos in place of --pole"),
        ("cos", "cosine of the pole's angle"),
    ):
        verb.add_argument(f"--{option}", metavar="COLUMN", help=what)
    verb.add_argument(
        "--segment",
        metavar="COLUMN",
        help="number of the run that a row belongs to; each run becomes a recording in BAG/",
    )


def _add_clock(verb: argparse.ArgumentParser) -> None:
    """Add what the clock of the rows is, and the file of commands on the same clock."""
    verb.add_argument(
        "--join",
        type=Path,
        metavar="FILE",
        help="the file that holds the command, with times of the same clock",
    )
    verb.add_argument(
        "--join-time",
        metavar="COLUMN",
        help="time of each command in that file (default: the column named by --time)",
    )
    verb.add_argument(
        "--rate",
        dest="rate_hz",
        type=read_above_zero,
        metavar="HZ",
        help="rows a second, for a file without times",
    )


def _add_command_times(verb: argparse.ArgumentParser) -> None:
    """Add when the command of a row acts."""
    verb.add_argument(
        "--command-acts",
        choices=("after", "before"),
        default="after",
        help="whether the command of a row acts after its positions or acted before them, as a "
        "log of the last command has it (default: after)",
    )


def _add_units(verb: argparse.ArgumentParser) -> None:
    """Add the units of the columns, and where the angle is 0."""
    since = "default: s, or what times since 1970 show"
    for option, units, default in (
        ("length-unit", ("m", "cm", "mm"), "m"),
        ("angle-unit", ("rad", "deg", "turn"), "rad"),
        ("time-unit", ("s", "ms", "us", "ns"), None),
        ("command-unit", COMMAND_UNITS, "one"),
    ):
        said = f"default: {default}" if default else since
        if option == "command-unit":
            said += ", which keeps volts and any other unit"
        action = verb.add_argument(f"--{option}", choices=units, default=default, help=said)
        if option == "command-unit":
            action.type = _read_command_unit
    verb.add_argument(
        "--pole-zero",
        choices=("up", "down"),
        default="up",
        help="where the angle is 0",
    )


def _read_command_unit(text: str) -> str:
    """Return the unit; any other name is refused with what to do, for commands have many units."""
    if text not in COMMAND_UNITS:
        raise argparse.ArgumentTypeError(
            f"expected {', '.join(COMMAND_UNITS)}, found {text!r}: leave the option out to keep "
            "volts or any other unit as it is"
        )
    return text


def _add_changes(verb: argparse.ArgumentParser) -> None:
    """Add what is left out, and what is turned round."""
    verb.add_argument(
        "--skip",
        type=read_seconds,
        default=0.0,
        metavar="S",
        help="leave out the first S seconds",
    )
    verb.add_argument("--invert-cart", action="store_true", help="turn the cart's sign round")
    verb.add_argument("--invert-pole", action="store_true", help="turn the pole's sign round")
