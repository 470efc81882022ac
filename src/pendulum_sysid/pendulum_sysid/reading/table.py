"""Columns of numbers by name or number, whichever kind of file they stand in."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from pendulum_sysid.errors import WrongUse
from pendulum_twin.arrays import Floats
from pendulum_twin.suggest import add_hint


@dataclass(frozen=True)
class Table:
    """Hold the columns of a file.

    names: of the columns; empty when the file has no header.
    width: number of columns.
    lines: (rows,) where each row stands, for messages.
    read: number of a column, from 0 -> (rows,) its values, NaN for empty cells.
    header_line: where a header was looked for.
    warnings: sentences about what was left out behind the last row.
    """

    names: tuple[str, ...]
    width: int
    lines: tuple[int, ...]
    read: Callable[[int], Floats]
    header_line: int = 1
    warnings: tuple[str, ...] = ()

    def get_column(self, name: str, option: str) -> Floats:
        """Return a column (rows,) by its name, or by its number from 1: `#2` or `2`.

        option: the command-line option that names the column.

        Raises WrongUse when there is none, or several of this name, and FileError for a cell that
        is no number.
        """
        places = [k for k, there in enumerate(self.names, 1) if there == name]
        if len(places) > 1:
            numbers = " or ".join(map(str, places))
            raise WrongUse(
                f"expected a single column {name}, found {len(places)} of this name: give the "
                f"number of the right column, {option} {numbers}"
            )
        if places:
            return self.read(self.names.index(name))
        number = name.removeprefix("#")
        if number.isdecimal() and 1 <= int(number) <= self.width:
            return self.read(int(number) - 1)
        if not self.names:
            raise WrongUse(
                f"expected a header with {self.width} names, {name} among them, found none in "
                f"line {self.header_line}: give {option} the number of a column, 1 to {self.width}"
            )
        raise WrongUse(
            f"expected a column {name}, found {', '.join(self.names)}: name one of these with "
            f"{option}{add_hint(name, self.names)}"
        )

    def split(self, name: str, option: str) -> list[tuple[float, Table]]:
        """Return the runs of rows with one value of a column, with that value, in their order.

        name, option: as of `get_column`, whose errors are raised. Rows without a value belong to
        no run.
        """
        values = self.get_column(name, option)
        if not len(values):
            return []
        begins = np.flatnonzero(np.r_[True, values[1:] != values[:-1]])
        ends = [*begins[1:], len(values)]
        return [
            (float(values[begin]), self._take(slice(begin, end)))
            for begin, end in zip(begins, ends, strict=True)
            if np.isfinite(values[begin])
        ]

    def _take(self, rows: slice) -> Table:
        return replace(
            self,
            lines=self.lines[rows],
            read=lambda place: self.read(place)[rows],
            warnings=self.warnings if rows.stop == len(self.lines) else (),
        )
