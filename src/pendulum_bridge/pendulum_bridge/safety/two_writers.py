"""Find out that two writers send commands at the same time, by the numbers that their messages carry.

Each writer numbers its messages 1, 2, 3, ..., so two at once are two rows of numbers. A row that
goes on after another row was heard means two; a writer that merely exists sends nothing, and one
that takes over from another is followed by no more of the old row.
"""

from __future__ import annotations

from dataclasses import dataclass

TOGETHER_S = 0.5  # two that are heard again within this time send at the same time; it ends when one is silent for so long


@dataclass(frozen=True)
class Row:
    """Hold one row of numbers: its last one, and when that was heard (monotonic, s)."""

    number: int
    heard_s: float


@dataclass(frozen=True)
class Writers:
    """Hold the rows heard lately, the one heard last at the end, and until when they count as two (monotonic, s)."""

    rows: tuple[Row, ...] = ()
    two_until_s: float | None = None


def hear_writer(number: int, now_s: float, writers: Writers) -> Writers:
    """Return the writers after a message with this number.

    It belongs to the row that it takes furthest the least, since messages may be lost: each row
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
    """Return how far a message would take a row; infinite when it cannot belong there."""
    return number - row.number if number > row.number else float("inf")
