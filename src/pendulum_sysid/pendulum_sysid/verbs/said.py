"""What a command says beside its answer, on stderr, and the exit statuses that go with it."""

from __future__ import annotations

import sys

ANSWERED, NOT_ANSWERED, WRONG_USE, INTERRUPTED = 0, 1, 2, 130


def say(sentence: str, status: int = NOT_ANSWERED) -> int:
    """Print a sentence on stderr, on one line, and return the status."""
    print("sysid:", " ".join(sentence.split()), file=sys.stderr, flush=True)
    return status


def print_progress(line: str) -> None:
    """Print on stderr how far a long command has come."""
    print(line, file=sys.stderr, flush=True)
