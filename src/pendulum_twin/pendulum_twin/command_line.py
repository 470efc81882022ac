"""What the command lines of this workspace do alike: read checked options, and end in one sentence."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Callable

from pendulum_twin.errors import BadInputError

MOST_DIGITS = 18


def run_command(name: str, work: Callable[[], int | None], interrupted: str) -> int:
    """Do the work and return the exit status: its own, 0 when it gives none, or 1 when it could not be done.

    Bad input, a file that cannot be used, and Ctrl-C (told as `interrupted`) end in one line on
    stderr.
    """
    try:
        return work() or 0
    except (BadInputError, OSError) as error:
        said = str(error)
    except KeyboardInterrupt:
        said = f"interrupted; {interrupted}"
    print(f"{name}: {said}", file=sys.stderr)
    return 1


def as_option[T](read: Callable[[str], T]) -> Callable[[str], T]:
    """Return a reader of text for `argparse`, which shows the sentence of a BadInputError as its own."""

    def reader(text: str) -> T:
        try:
            return read(text)
        except BadInputError as error:
            raise argparse.ArgumentTypeError(str(error)) from error

    return reader


def make_whole_reader(low: int = 0, high: int | None = None) -> Callable[[str], int]:
    """Return the reader of a whole number from low to high, both included."""
    wanted = f"from {low} on" if high is None else f"from {low} to {high}"

    @as_option
    def read(text: str) -> int:
        number = (
            int(text) if text.isascii() and text.isdigit() and len(text) <= MOST_DIGITS else -1
        )
        if number < low or (high is not None and number > high):
            raise BadInputError(f"expected a whole number {wanted}, found {text!r}")
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
