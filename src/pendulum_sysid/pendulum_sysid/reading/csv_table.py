"""Read a CSV file as laboratories write them: comments, no header, semicolons, decimal commas."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pendulum_sysid.errors import FileError
from pendulum_sysid.reading.table import Table
from pendulum_twin.arrays import Floats
from pendulum_twin.files import describe_read_error

SEPARATORS = ";\t,"  # the first that stands in the header; blanks where none does
COMMENTS = ("#", "%")
GROUPED = re.compile(r"[+-]?[1-9]\d{0,2}(?:([.,])\d{3})(?:\1\d{3})*")  # 1.234 or 1,234,567
WHOLE = re.compile(r"[+-]?\d{1,3}")
Row = tuple[int, list[str]]  # line, cells


@dataclass(frozen=True)
class Cells:
    """Hold the cells of a CSV file as text.

    names: as Table has them, for messages.
    rows: below the header, each with as many cells.
    has_decimal_comma: a comma in a number stands for the point.
    """

    names: tuple[str, ...]
    rows: tuple[Row, ...]
    has_decimal_comma: bool

    def read(self, place: int) -> Floats:
        """Return a column (rows,); raises FileError for a cell that is no number."""
        self._refuse_thousands(place)
        return np.array([self._read_number(row, place) for row in self.rows], dtype=np.float64)

    def _refuse_thousands(self, place: int) -> None:
        """Raise FileError where marks in a column stand before thousands, not before decimals.

        A number from 1000 on then has groups of three digits, none below has a mark, and some
        below are hundreds. Decimals of three digits without exception show in numbers below 1000,
        too; a command of 0 and 1.125 has no hundreds.
        """
        texts = [(line, cells[place].strip()) for line, cells in self.rows]
        grouped = [(line, text) for line, text in texts if GROUPED.fullmatch(text)]
        others = [text for _, text in texts if text and not GROUPED.fullmatch(text)]
        whole = all(WHOLE.fullmatch(text) for text in others)
        hundreds = any(len(text.lstrip("+-")) == 3 for text in others)
        if not (grouped and whole and hundreds):
            return
        line, text = grouped[0]
        name = self.names[place] if place < len(self.names) else f"#{place + 1}"
        raise FileError(
            f"expected numbers without thousands separators in column {name}, found {text!r} in "
            f"line {line} beside whole numbers below 1000: export the file without them"
        )

    def _read_number(self, row: Row, place: int) -> float:
        line, cells = row
        cell = cells[place].strip()
        try:
            return _parse(cell, self.has_decimal_comma) if cell else np.nan
        except ValueError as error:
            name = self.names[place] if place < len(self.names) else f"#{place + 1}"
            raise FileError(
                f"expected a number in line {line} of column {name}, found {cell!r}: correct or "
                "remove the row"
            ) from error


def read_csv_table(path: Path) -> Table:
    """Return the columns of a CSV file.

    Lines that begin with # or % are comments; the last one above the first row is the header if
    the first row holds numbers. A header names nothing where most rows have more or fewer cells.
    Rows without a number right below the header (units) are left out, and so are, with a warning,
    lines without a number behind the last row and a last row that was cut off. Text behind the
    last column of numbers may be missing, or hold separators. Raises FileError when the file is
    empty or no text, or another row has more or fewer cells.
    """
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise FileError(
            f"expected a CSV file, but it cannot be read: {describe_read_error(error)}"
        ) from error
    numbered = [(k, line.strip(" ")) for k, line in enumerate(lines, 1) if line.strip(" \t;,")]
    kept = [(k, line) for k, line in numbered if not line.lstrip().startswith(COMMENTS)]
    if not kept:
        raise FileError("expected a CSV file with a header, found it empty: export it again")
    separator = next((mark for mark in SEPARATORS if mark in kept[0][1].strip()), None)
    comma = separator != ","
    rows = [(k, _split(line, separator)) for k, line in kept]
    first, header_line = rows[0][1], rows[0][0]
    if all(_is_number(cell, comma) for cell in first if cell.strip()):
        above = [line for k, line in numbered if k < header_line]
        names = _split(above[-1].lstrip("#% \t"), separator) if above else []
    else:
        names, rows = _drop_blank_end(first, 0), rows[1:]
        while rows and not _holds_number(rows[0], comma):
            rows = rows[1:]
    if not _fits_most(rows, len(names)):
        names = []  # a name may hold the separator
    width, like = (len(names), "the header") if names else (_count_cells(rows), "most rows")
    whole, warnings = _take_whole_rows(rows, width, like, comma)
    cells = Cells(tuple(cell.strip() for cell in names), whole, comma)
    return Table(cells.names, width, tuple(k for k, _ in whole), cells.read, header_line, warnings)


def _holds_number(row: Row, comma: bool) -> bool:
    return any(_is_number(cell, comma) for cell in row[1])


def _fits_most(rows: Sequence[Row], width: int) -> bool:
    """Return whether at least half of the rows have as many cells."""
    fitting = sum(len(_drop_blank_end(cells, width)) == width for _, cells in rows)
    return 2 * fitting >= len(rows)


def _count_cells(rows: Sequence[Row]) -> int:
    """Return how many cells most rows have; 0 without rows."""
    return Counter(len(cells) for _, cells in rows).most_common(1)[0][0] if rows else 0


def _take_whole_rows(
    rows: Sequence[Row], width: int, like: str, comma: bool
) -> tuple[tuple[Row, ...], tuple[str, ...]]:
    """Return the rows, each with as many cells, and sentences about what was left out.

    like: what has so many cells, in words.

    Raises FileError for a row whose numbers stand in the wrong columns.
    """
    trimmed = [(line, _drop_blank_end(cells, width)) for line, cells in rows]
    warnings: list[str] = []
    while trimmed and not _holds_number(trimmed[-1], comma):
        warnings.append(f"line {trimmed.pop()[0]} holds no number: it is left out")
    numbers = _count_number_columns([c for _, c in trimmed if len(c) == width], width, comma)
    broken = [(line, len(c)) for line, c in trimmed if not _is_whole(c, width, numbers, comma)]
    if broken and broken[0][0] == trimmed[-1][0] and broken[0][1] < width:
        line, count = broken.pop()
        trimmed.pop()
        warnings.append(
            f"the file ends in line {line} with {count} of {width} cells: this row is left out"
        )
    if broken:
        line, count = broken[0]
        raise FileError(
            f"expected {width} cells in every row, as in {like}, found {count} in line {line} "
            f"({len(broken)} of {len(rows)} rows differ): correct them, or remove them"
        )
    whole = tuple((line, [*c[:width], *[""] * (width - len(c))]) for line, c in trimmed)
    return whole, tuple(warnings)


def _count_number_columns(rows: Sequence[list[str]], width: int, comma: bool) -> int:
    """Return up to which column rows hold numbers: in most of its cells that are not empty."""
    last = 0
    for place in range(width):
        filled = [row[place] for row in rows if row[place].strip()]
        if 2 * sum(_is_number(cell, comma) for cell in filled) > len(filled):
            last = place + 1
    return last


def _is_whole(cells: list[str], width: int, numbers: int, comma: bool) -> bool:
    """Return whether the cells of a row stand in their columns.

    numbers: up to this column rows hold numbers; behind it stands text, with any separators.
    """
    if len(cells) == width:
        return True
    there = all(_is_number(cell, comma) for cell in cells[:numbers] if cell.strip())
    behind = any(_is_number(cell, comma) for cell in cells[numbers:])
    return len(cells) >= numbers and there and not behind


def _drop_blank_end(cells: list[str], least: int) -> list[str]:
    """Return cells without the empty cells at their end, at least so many of them."""
    count = len(cells)
    while count > least and not cells[count - 1].strip():
        count -= 1
    return cells[:count]


def _split(line: str, separator: str | None) -> list[str]:
    try:
        return line.split() if separator is None else next(csv.reader([line], delimiter=separator))
    except (csv.Error, StopIteration) as error:
        raise FileError(f"expected a CSV file, but it cannot be read: {error}") from error


def _is_number(cell: str, comma: bool) -> bool:
    try:
        _parse(cell, comma)
    except ValueError:
        return False
    return True


def _parse(cell: str, comma: bool) -> float:
    return float(cell.replace(",", ".") if comma else cell)
