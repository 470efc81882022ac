"""When the rows of a table were taken, in s, from its column of times or a rate."""

from __future__ import annotations

import numpy as np

from pendulum_sysid.errors import FileError, WrongUse
from pendulum_sysid.reading.columns import EPOCH_S, TIME_UNITS, Columns
from pendulum_sysid.reading.table import Table
from pendulum_twin.arrays import Floats, Ints, Mask

LONGEST_S = 2.0**31  # what a stamp of ROS holds


def read_times(table: Table, columns: Columns) -> tuple[Ints, Mask, float]:
    """Return the sampling times in ns from the first one taken, and which rows are taken.

    The third is the time of the first row taken by the file's clock, s. Raises FileError for a
    table without rows and for times that are missing, fall, stand still or last too long, and
    WrongUse where the columns name no such column or skip all rows.
    """
    if len(table.lines) < 2:
        count = len(table.lines) or "none"
        raise FileError(
            f"expected rows of numbers below the header, found {count}: export the file again"
        )
    times, begin_s = np.arange(len(table.lines)) / (columns.rate_hz or 1.0), 0.0
    if columns.time is not None:
        times, begin_s = read_seconds(table, columns.time, columns.time_unit)
    if times[-1] - times[0] >= LONGEST_S:
        raise FileError(
            f"expected times in s, found {times[-1] - times[0]:.3g} s in all: give their unit "
            "with --time-unit"
        )
    chosen: Mask = times - times[0] >= columns.skip
    if np.count_nonzero(chosen) < 2:
        raise WrongUse(
            f"expected rows after the first {columns.skip:g} s, found only "
            f"{times[-1] - times[0]:.6g} s in all: skip less"
        )
    taken = times[chosen]
    if taken[-1] == taken[0]:
        raise FileError(
            f"expected times that rise in column {columns.time}, found "
            f"{begin_s + taken[0]:.9g} in all {len(taken)} rows: name another column with --time, "
            "or give --rate"
        )
    stamps_ns = np.rint((taken - taken[0]) * 1e9).astype(np.int64)
    return stamps_ns, chosen, begin_s + float(taken[0] - times[0])


def read_seconds(
    table: Table, name: str, unit: str | None, option: str = "--time"
) -> tuple[Floats, float]:
    """Return a column of times in s from its first row, (rows,), and the time of that row, s.

    unit: key of TIME_UNITS; None for s, or what times since 1970 show.
    option: the command-line option that names the column.

    Raises WrongUse when there is no such column, FileError for a time that is missing or falls.
    """
    times = table.get_column(name, option)
    if not np.all(np.isfinite(times)):
        line = table.lines[int(np.argmin(np.isfinite(times)))]
        raise FileError(
            f"expected a time in every row, found none in line {line} of column {name}: remove "
            "the row"
        )
    falls = np.flatnonzero(np.diff(times) < 0)
    if len(falls):
        line = table.lines[falls[0] + 1]
        raise FileError(
            f"expected times that rise in column {name}, found {times[falls[0] + 1]:.9g} after "
            f"{times[falls[0]]:.9g} in line {line}: import each run by itself, with --segment "
            "where a column numbers the runs"
        )
    since_1970 = [u for u, s in TIME_UNITS.items() if EPOCH_S[0] <= times[0] * s < EPOCH_S[1]]
    second = TIME_UNITS[unit or (since_1970 or ["s"])[0]]
    return (times - times[0]) * second, float(times[0]) * second
