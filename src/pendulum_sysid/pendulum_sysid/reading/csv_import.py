"""Turn columns of a CSV file into a recording like the recorder's."""

from __future__ import annotations

import csv as csv_format
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.errors import FileError, WrongUse
from pendulum_sysid.reading.bag import write_bag
from pendulum_twin.arrays import Floats
from pendulum_twin.errors import BadInputError

ZEROS = {"up": 0.0, "down": np.pi}  # where the file's angle is 0 -> what it is called here
SEPARATORS = ",;\t"


@dataclass(frozen=True)
class Table:
    """Hold a CSV file as text: header, and rows with the line they stand on."""

    header: tuple[str, ...]
    rows: tuple[tuple[int, list[str]], ...]


def import_csv(
    csv: str | Path,
    out: str | Path,
    time: str,
    command: str | None = None,
    cart: str | None = None,
    pole: str | None = None,
    pole_zero: str = "up",
    skip: float = 0.0,
    invert_cart: bool = False,
    invert_pole: bool = False,
) -> None:
    """Write columns of a CSV file (SI units) as a recording with the default topics.

    time: s, from any zero; the recording begins at 0. command: as the twin file has it; only a
    pole alone may lack it.
    cart: m. pole: rad, counterclockwise positive after invert_pole; pole_zero says whether 0 is up
    or (then pi is added) down; a wrapped angle stays wrapped. skip: s to leave out at the
    beginning. An empty cell or nan is a missing value. Raises FileError when the file, a
    column or a cell is not as expected, or the recording cannot be written.
    """
    try:
        table = _read(Path(csv))
        stamps_ns, chosen = _read_times(table, time, skip)
        columns = _read_columns(table, {"command": command, "cart": cart, "pole": pole}, chosen)
    except BadInputError as error:
        raise type(error)(f"{csv}: {error}") from error
    if pole_zero not in ZEROS:
        raise WrongUse(f"expected --pole-zero up or down, found {pole_zero}")
    joints = {}
    if "cart" in columns:
        joints["cart"] = -columns["cart"] if invert_cart else columns["cart"]
    if "pole" in columns:
        joints["pole"] = (-columns["pole"] if invert_pole else columns["pole"]) + ZEROS[pole_zero]
    write_bag(out, stamps_ns, joints, columns.get("command"))


def _read(path: Path) -> Table:
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            first = stream.readline()
            stream.seek(0)
            separator = max(SEPARATORS, key=first.count)
            reader = csv_format.reader(stream, delimiter=separator)
            rows = [(reader.line_num, row) for row in reader if any(cell.strip() for cell in row)]
    except (OSError, UnicodeDecodeError, csv_format.Error) as error:
        raise FileError(f"expected a CSV file, but it cannot be read: {error}") from error
    if not rows:
        raise FileError("expected a CSV file with a header, found it empty: export it again")
    header = tuple(cell.strip() for cell in rows[0][1])
    if all(_is_number(cell) for cell in header):
        raise FileError(
            f"expected a header that names the columns, found numbers in line {rows[0][0]}: add "
            "one"
        )
    return Table(header, tuple(rows[1:]))


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _read_times(table: Table, name: str, skip: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the sampling times in ns from the first one taken, and which rows are taken."""
    times = _read_column(table, name, "--time")
    if not len(times):
        raise FileError(
            "expected rows of numbers below the header, found none: export the file again"
        )
    if not np.all(np.isfinite(times)):
        line = table.rows[int(np.argmin(np.isfinite(times)))][0]
        raise FileError(
            f"expected a time in every row, found none in line {line} of column {name}: remove "
            "the row"
        )
    falls = np.flatnonzero(np.diff(times) < 0)
    if len(falls):
        line = table.rows[falls[0] + 1][0]
        raise FileError(
            f"expected times that rise in column {name}, found {times[falls[0] + 1]:.9g} after "
            f"{times[falls[0]]:.9g} "
            f"in line {line}: import each run by itself"
        )
    chosen = times - times[0] >= skip
    if np.count_nonzero(chosen) < 2:
        raise WrongUse(
            f"expected rows after the first {skip:g} s, found only {times[-1] - times[0]:.6g} s "
            "in all: skip less"
        )
    taken = times[chosen]
    return np.rint((taken - taken[0]) * 1e9).astype(np.int64), chosen


def _read_columns(
    table: Table, names: dict[str, str | None], chosen: np.ndarray
) -> dict[str, Floats]:
    """Return the columns asked for, in the rows taken."""
    if names["cart"] is None and names["pole"] is None:
        raise WrongUse(
            "expected a position column, found neither --cart nor --pole: name at least one"
        )
    if names["cart"] is not None and names["command"] is None:
        raise WrongUse(
            "expected the command column of a recording with a cart, found none: name it with "
            "--command"
        )
    columns = {}
    for channel, name in names.items():
        if name is None:
            continue
        values = _read_column(table, name, f"--{channel}")[chosen]
        missing = np.count_nonzero(~np.isfinite(values))
        if missing > decisions.MOST_NOT_FINITE * len(values):
            raise FileError(
                f"expected finite numbers in column {name}, found {missing} of {len(values)} "
                "cells empty, nan or "
                f"infinite: at most {decisions.MOST_NOT_FINITE:.0%} can be done without"
            )
        columns[channel] = values
    return columns


def _read_column(table: Table, name: str, option: str) -> Floats:
    """Return a column by its name in the header, NaN for empty cells."""
    if name not in table.header:
        raise WrongUse(
            f"expected a column {name}, found {', '.join(table.header)}: name one of these with "
            f"{option}"
        )
    place = table.header.index(name)
    return np.array(
        [_read_number(row, place, line, name) for line, row in table.rows], dtype=np.float64
    )


def _read_number(row: list[str], place: int, line: int, name: str) -> float:
    cell = row[place].strip() if place < len(row) else ""
    try:
        return float(cell) if cell else np.nan
    except ValueError as error:
        raise FileError(
            f"expected a number in line {line} of column {name}, found {cell!r}: correct or "
            "remove the row"
        ) from error
