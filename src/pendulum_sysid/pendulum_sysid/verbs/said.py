"""What a command says: its answer on stdout, all else on stderr, and the exit statuses."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable
from enum import Enum
from typing import Any, TextIO

ANSWERED, NOT_ANSWERED, WRONG_USE, INTERRUPTED = 0, 1, 2, 130
CLEAR_LINE = "\r\x1b[K"


class Colour(Enum):
    """The colours of a terminal, by what they stand for."""

    GOOD = "32"
    DOUBTFUL = "33"
    BAD = "31"
    FAINT = "2"


def is_terminal(stream: TextIO) -> bool:
    """Return whether a stream is a terminal that moves its cursor and shows colours."""
    return stream.isatty() and os.environ.get("TERM") != "dumb"


def paint(text: str, colour: Colour, stream: TextIO) -> str:
    """Return text in a colour on a terminal, else as it is; NO_COLOR turns all colours off."""
    if not is_terminal(stream) or os.environ.get("NO_COLOR"):
        return text
    return f"\x1b[{colour.value}m{text}\x1b[0m"


def say(sentence: str, status: int = NOT_ANSWERED) -> int:
    """Print a sentence on stderr, on one line, and return the status."""
    clear = CLEAR_LINE if is_terminal(sys.stderr) else ""  # of the progress
    name = paint("sysid:", Colour.DOUBTFUL if status == ANSWERED else Colour.BAD, sys.stderr)
    print(f"{clear}{name} {' '.join(sentence.split())}", file=sys.stderr, flush=True)
    return status


def print_answer(
    arguments: argparse.Namespace, mapping: Callable[[], Any], *lines: object
) -> None:
    """End the progress and print the answer: with --json one JSON object, else lines of text.

    mapping: returns what --json prints.
    """
    arguments.progress.end()
    if arguments.json:
        from pendulum_sysid.telling.output_files import format_json  # not for help: needs numpy

        print(format_json(mapping()), flush=True)
    else:
        print(*lines, sep="\n", flush=True)
