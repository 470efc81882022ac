"""Detect two simultaneous writers of commands by the sequence numbers of their messages.

Each writer numbers its messages 1, 2, 3, ..., so two writers give two sequences of numbers. A
sequence that goes on after another was heard means two writers. A writer that merely exists sends
nothing, and after a writer that takes over from another the old sequence does not go on.
"""

from __future__ import annotations

from dataclasses import dataclass

# writers that are both heard again within this time send at once, until one is silent for as long
TOGETHER_S = 0.5


@dataclass(frozen=True)
class Row:
    """Hold a sequence of numbers.

    number: its last number.
    heard_s: s, monotonic; when that was heard.
    """

    number: int
    heard_s: float


@dataclass(frozen=True)
class Writers:
    """Hold the sequences heard lately.

    rows: the sequence heard last stands at the end.
    two_until_s: s, monotonic; until when two writers are assumed; None for never.
    """

    rows: tuple[Row, ...] = ()
    two_until_s: float | None = None


def hear_writer(number: int, now_s: float, writers: Writers) -> Writers:
    """Return the writers after a message with this number.

    The message belongs to the sequence that it advances least: messages may be lost, and each
    sequence
    only grows.
    """
    rows = tuple(row for row in writers.rows if 0.0 <= now_s - row.heard_s < TOGETHER_S)
    own = min(reversed(rows), key=lambda row: _count_skipped(number, row), default=None)
    message = Row(number, now_s)
    if own is None or number <= own.number:
        return Writers((*rows, message), writers.two_until_s)
    others = tuple(row for row in rows if row is not own)
    goes_on = own is not rows[-1]
    return Writers((*others, message), now_s + TOGETHER_S if goes_on else writers.two_until_s)


def has_two_writers(writers: Writers, now_s: float) -> bool:
    """Tell whether two writers send at the same time."""
    return writers.two_until_s is not None and now_s < writers.two_until_s


def _count_skipped(number: int, row: Row) -> float:
    """Return how far a message would advance a sequence; infinite when it cannot belong to it."""
    return number - row.number if number > row.number else float("inf")
