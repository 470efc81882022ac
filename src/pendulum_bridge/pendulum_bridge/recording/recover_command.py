"""The command `recorder_node --recover FOLDER_OR_FILE`."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from pendulum_bridge.recording.recover import recover
from pendulum_twin.errors import BadInputError
from pendulum_twin.parser import Parser, add_common_options

OPTION = "--recover"


def run_recover(arguments: Sequence[str]) -> int:
    """Recover a bag, print what was kept and lost, and return 0.

    Returns 1 with the reason on stderr when there is nothing to recover.
    """
    parser = Parser(
        prog="recorder_node",
        description="Make a whole bag of what a killed recorder left.",
        examples=("recorder_node --recover recordings/monday",),
    )
    add_common_options(parser)
    parser.add_argument(
        OPTION,
        required=True,
        type=Path,
        metavar="FOLDER_OR_FILE",
        help="a rosbag2 folder or .mcap file",
    )
    options = parser.parse_args(arguments)
    path = options.recover
    try:
        sentence = recover(path).sentence
        if not options.quiet:
            print(sentence)
    except BadInputError as error:
        print(f"recorder_node: {error}", file=sys.stderr)
        return 1
    except OSError as error:
        print(
            f"recorder_node: {path}: expected a readable recording, found {error.strerror}",
            file=sys.stderr,
        )
        return 1
    return 0
