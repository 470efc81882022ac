"""Read checked options, and end in one sentence: what all command lines of the workspace do."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Callable

from pendulum_twin.errors import BadInputError, ReportedError
from pendulum_twin.version import __version__

MOST_DIGITS = 18
INTERRUPTED = 130  # exit status after Ctrl-C, as shells have it


def run_command(name: str, work: Callable[[], int | None], interrupted: str) -> int:
    """Do the work and return the exit status.

    name: of the program, before its messages.
    work: returns the exit status, None for 0.
    interrupted: what Ctrl-C has left behind, in words.

    A reported error, and a file that cannot be used, end in one line on stderr, with the
    exit status of the error or 1; Ctrl-C ends with INTERRUPTED.
    """
    try:
        return work() or 0
    except ReportedError as error:
        reason, status = str(error), error.exit_status
    except OSError as error:
        reason, status = str(error), 1
    except KeyboardInterrupt:
        reason, status = f"interrupted; {interrupted}", INTERRUPTED
    print(f"{name}: {reason}", file=sys.stderr)
    return status


def add_version(parser: argparse.ArgumentParser) -> None:
    """Add the option --version; the four packages are released together, with one version."""
    parser.add_argument("--version", action="version", version=f"%(prog)s {__version__}")


def as_option[T](read: Callable[[str], T]) -> Callable[[str], T]:
    """Return a reader for `argparse` that shows the sentence of a BadInputError as its own."""

    def read_option(text: str) -> T:
        try:
            return read(text)
        except BadInputError as error:
            raise argparse.ArgumentTypeError(str(error)) from error

    return read_option


def make_whole_reader(low: int = 0, high: int | None = None) -> Callable[[str], int]:
    """Return the reader of a whole number from low to high, both included."""
    bounds = f"from {low} on" if high is None else f"from {low} to {high}"

    @as_option
    def read(text: str) -> int:
        number = (
            int(text) if text.isascii() and text.isdigit() and len(text) <= MOST_DIGITS else -1
        )
        if number < low or (high is not None and number > high):
            raise BadInputError(f"expected a whole number {bounds}, found {text!r}")
        return number

    return read


def make_number_reader(low: float, high: float) -> Callable[[str], float]:
    """Return the reader of a number from low to high, both included."""

    @as_option
    def read(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not low <= value <= high:
            raise BadInputError(f"expected a number from {low:g} to {high:g}, found {text!r}")
        return value

    return read
