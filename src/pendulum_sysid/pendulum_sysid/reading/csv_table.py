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

    Lines that begin with # or % are comments; the last one above the first row is the header if it
    has as many cells as a row and the first row holds numbers. A header separated by blanks names
    nothing where no row has as many cells. Rows without a number right below the header (units)
    are left out, and so is a last row that was cut off, with a warning. Raises FileError when the
    file is empty or no text, or another row has more or fewer cells.
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
    names: list[str] = []
    if all(_is_number(cell, comma) for cell in first if cell.strip()):
        above = [line for k, line in numbered if k < header_line]
        comment = _split(above[-1].lstrip("#% \t"), separator) if above else []
        names = comment if len(comment) == _count_cells(rows) else []
    else:
        rows = rows[1:]
        while rows and not any(_is_number(cell, comma) for cell in rows[0][1]):
            rows = rows[1:]
        names = _drop_blank_end(first, 0)
        if separator is None and rows and all(len(row) != len(names) for _, row in rows):
            names = []  # they hold blanks, as the space between them
    width, like = (len(names), "the header") if names else (_count_cells(rows), "most rows")
    whole, warnings = _take_whole_rows(rows, width, like)
    cells = Cells(tuple(cell.strip() for cell in names), whole, comma)
    return Table(cells.names, width, tuple(k for k, _ in whole), cells.read, header_line, warnings)


def _count_cells(rows: Sequence[Row]) -> int:
    """Return how many cells most rows have."""
    return Counter(len(cells) for _, cells in rows).most_common(1)[0][0]


def _take_whole_rows(
    rows: Sequence[Row], width: int, like: str
) -> tuple[tuple[Row, ...], tuple[str, ...]]:
    """Return the rows, each with as many cells, and what was left out: a last row cut off.

    like: what has so many cells, in words.

    Empty cells beyond the width are separators at the end of a line. Raises FileError for a row
    with more or fewer cells: its values stand in the wrong columns.
    """
    trimmed = [(line, _drop_blank_end(cells, width)) for line, cells in rows]
    differing = [(line, len(cells)) for line, cells in trimmed if len(cells) != width]
    if not differing:
        return tuple(trimmed), ()
    line, count = differing[0]
    if line == trimmed[-1][0] and count < width:
        left_out = f"the file ends in line {line} with {count} of {width} cells"
        return tuple(trimmed[:-1]), (f"{left_out}: this row is left out",)
    raise FileError(
        f"expected {width} cells in every row, as in {like}, found {count} in line {line} "
        f"({len(differing)} of {len(rows)} rows differ): correct them, or remove them"
    )


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
