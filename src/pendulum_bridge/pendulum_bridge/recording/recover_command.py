"""The command `recorder_node --recover FOLDER_OR_FILE`."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from pendulum_bridge.recording.recover import recover
from pendulum_twin.errors import BadInputError

OPTION = "--recover"


def run_recover(arguments: Sequence[str]) -> int:
    """Recover a bag, print what was kept and lost, and return 0.

    Returns 1 with the reason on stderr when there is nothing to recover.
    """
    parser = argparse.ArgumentParser(
        prog="recorder_node", description="Make a whole bag of what a killed recorder left."
    )
    parser.add_argument(
        OPTION,
        required=True,
        type=Path,
        metavar="FOLDER_OR_FILE",
        help="a rosbag2 folder or .mcap file",
    )
    path = parser.parse_args(arguments).recover
    try:
        print(recover(path).sentence)
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
