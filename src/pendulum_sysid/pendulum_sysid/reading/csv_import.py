"""Turn columns of a file of a laboratory into a recording like the recorder's."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.errors import FileError
from pendulum_sysid.reading.array_table import ARRAY_SUFFIXES, read_array_table
from pendulum_sysid.reading.bag import write_bag
from pendulum_sysid.reading.bag_files import ROS1_SUFFIX, is_data_file
from pendulum_sysid.reading.columns import (
    ANGLE_UNITS,
    COMMAND_UNITS,
    LENGTH_UNITS,
    ZEROS,
    Columns,
    check_columns,
)
from pendulum_sysid.reading.csv_table import read_csv_table
from pendulum_sysid.reading.table import Table
from pendulum_sysid.reading.table_times import LONGEST_S, read_seconds, read_times
from pendulum_twin.arrays import Floats, Ints, Mask
from pendulum_twin.errors import BadInputError


@dataclass(frozen=True)
class Imported:
    """Say what an import has read.

    rows: number of samples.
    seconds: s, from the first to the last.
    ranges: channel -> least and largest finite value, m, rad and the command's unit.
    begins_at_rad: rad, 0 to 2 pi, the pole's angle at the beginning; None without a pole.
    warnings: sentences about rows that were left out, and about what makes the recording unusable.
    """

    rows: int
    seconds: float
    ranges: dict[str, tuple[float, float]]
    begins_at_rad: float | None
    warnings: tuple[str, ...] = ()

    @property
    def rate_hz(self) -> float:
        """Return the mean rate of the samples."""
        return (self.rows - 1) / self.seconds if self.seconds > 0 else math.inf


def import_csv(csv: str | Path, out: str | Path, columns: Columns) -> Imported:
    """Write columns of a CSV, .mat, .npz or .parquet file as a recording with the default topics.

    The recording begins at 0 s. An empty cell or nan is a missing value. Raises FileError when the
    file, a column or a cell is not as expected, or the recording cannot be written, and WrongUse
    when options do not fit it.
    """
    check_columns(columns)
    with _name_file(csv):
        content = _read_content(_read_table(Path(csv), columns), columns)
    return _write(content, out)


def import_segments(csv: str | Path, folder: Path, columns: Columns) -> dict[Path, Imported]:
    """Write each run of a file as a recording of its own in a folder; return what was read.

    A recording is named by the value that the segment column has in its run. Raises the errors of
    `import_csv`, before anything is written where a run cannot be read.
    """
    check_columns(columns)
    contents: dict[Path, Content] = {}
    with _name_file(csv):
        runs = _read_table(Path(csv), columns).split(columns.segment or "", "--segment")
        if not runs:
            raise FileError(
                f"expected the number of a run in column {columns.segment}, found none in any "
                "row: name another column with --segment"
            )
        for value, table in runs:
            out = folder / f"{value:.15g}"
            if out in contents:
                out = folder / f"{value:.15g}_line_{table.lines[0]}"
            with _name_file(f"run {value:.15g} from line {table.lines[0]}"):
                contents[out] = _read_content(table, columns)
    return {out: _write(content, out) for out, content in contents.items()}


@contextmanager
def _name_file(file: str | Path) -> Iterator[None]:
    """Put the name of a file before what is said of it."""
    try:
        yield
    except BadInputError as error:
        raise type(error)(f"{file}: {error}") from error


@dataclass(frozen=True)
class Content:
    """Hold what a recording is written from.

    stamps_ns: (n,) sampling times, ns from the first.
    joints: joint -> (n,) positions, m or rad.
    velocities: joint -> (n,) m/s or rad/s; empty for none.
    command: (m,) commands; None for none.
    sent_ns: (m,) when they were sent; None for at the samples.
    warnings: sentences about rows that were left out.
    """

    stamps_ns: Ints
    joints: dict[str, Floats]
    velocities: dict[str, Floats]
    command: Floats | None
    sent_ns: Ints | None
    warnings: tuple[str, ...] = ()


def _read_content(table: Table, columns: Columns) -> Content:
    stamps_ns, chosen, begin_s = read_times(table, columns)
    sent_ns: Ints | None = None
    warnings = table.warnings
    if columns.join is None:
        command = _read_channel(table, columns.command, "--command", chosen)
        if command is not None and columns.command_acts == "before":
            command = np.append(command[1:], command[-1])
    else:
        sent_ns, command, doubts = _read_joined(columns, begin_s, int(stamps_ns[-1]))
        warnings = (*warnings, *(f"{columns.join}: {doubt}" for doubt in doubts))
    joints = _read_positions(table, columns, chosen)
    velocities = _read_velocities(table, columns, chosen)
    if command is not None:
        command = command * COMMAND_UNITS[columns.command_unit]
    if velocities:
        velocities = {j: velocities.get(j, np.full(len(stamps_ns), np.nan)) for j in joints}
    return Content(stamps_ns, joints, velocities, command, sent_ns, warnings)


def _write(content: Content, out: str | Path) -> Imported:
    write_bag(
        out,
        content.stamps_ns,
        content.joints,
        content.command,
        velocities=content.velocities,
        command_times_ns=content.sent_ns,
    )
    imported = _describe(content.stamps_ns, content.joints, content.command)
    return replace(imported, warnings=(*content.warnings, *_list_doubts(imported)))


def _read_table(path: Path, columns: Columns) -> Table:
    if path.is_file() and path.suffix.lower() == ROS1_SUFFIX:
        raise FileError(
            "expected a CSV, .mat, .npz or .parquet file, found a bag of ROS 1: import it by "
            "itself, without columns"
        )
    if any(map(is_data_file, (path, *path.glob("*")))):
        raise FileError(
            "expected a CSV, .mat, .npz or .parquet file, found a recording: nothing is to be "
            "imported, give it to sysid diagnose"
        )
    if path.is_dir():
        raise FileError(
            "expected a CSV, .mat, .npz or .parquet file, found a folder: name the files in it"
        )
    if path.suffix.lower() not in ARRAY_SUFFIXES:
        return read_csv_table(path)
    return read_array_table(path, (columns.time, columns.cart, columns.pole, columns.sin))


def _read_joined(
    columns: Columns, begin_s: float, last_ns: int
) -> tuple[Ints, Floats, tuple[str, ...]]:
    """Return when the commands of another file were sent, ns from begin_s, and the commands.

    The third are sentences about rows of that file that were left out.

    begin_s: time of the first sample by the clock of both files, s.
    last_ns: time of the last sample, ns from there.

    A command holds until the next: the last before the first sample counts as sent with it.
    Commands after the last sample are left out.
    """
    file, name = Path(columns.join or ""), columns.join_time or columns.time or ""
    with _name_file(file):
        table = _read_table(file, Columns(name))
        if not table.lines:
            raise FileError("expected rows of commands, found none: export the file again")
        times, first_s = read_seconds(table, name, columns.time_unit, "--join-time")
        command = table.get_column(columns.command or "", "--command")
    known = np.isfinite(command)
    sent_s, command = times[known] + (first_s - begin_s), command[known]
    with _name_file(file):
        _check_sent(sent_s, last_ns * 1e-9)
    sent_ns = np.rint(sent_s * 1e9).astype(np.int64)
    first = max(int(np.searchsorted(sent_ns, 0, side="right")) - 1, 0)
    after = int(np.searchsorted(sent_ns, last_ns, side="right"))
    return np.maximum(sent_ns[first:after], 0), command[first:after], table.warnings


def _check_sent(sent_s: Floats, end_s: float) -> None:
    """Raise FileError where no commands, sent at (m,) s, reach into the samples, 0 to end_s."""
    if not len(sent_s):
        raise FileError("expected commands, found none: name another column with --command")
    if np.ptp(sent_s) >= LONGEST_S:
        raise FileError(
            f"expected times of commands in s, found {np.ptp(sent_s):.3g} s in all: give their "
            "unit with --time-unit"
        )
    if sent_s[0] > end_s + 0.5e-9 or sent_s[-1] < -0.5e-9:  # a nanosecond is the least step
        apart = (
            f"the last {-sent_s[-1]:.6g} s before the first sample"
            if sent_s[-1] < 0
            else f"the first {sent_s[0] - end_s:.6g} s after the last sample"
        )
        raise FileError(
            f"expected commands while the samples were taken, found {apart}: are both times of "
            "one clock?"
        )


def _read_positions(table: Table, columns: Columns, chosen: Mask) -> dict[str, Floats]:
    """Return joint -> positions in the rows taken, m and rad."""
    joints = {}
    cart = _read_channel(table, columns.cart, "--cart", chosen)
    if cart is not None:
        joints["cart"] = cart * LENGTH_UNITS[columns.length_unit] * (1 - 2 * columns.invert_cart)
    pole = _read_channel(table, columns.pole, "--pole", chosen)
    if pole is not None:
        pole = pole * ANGLE_UNITS[columns.angle_unit]
    sin = _read_channel(table, columns.sin, "--sin", chosen)
    cos = _read_channel(table, columns.cos, "--cos", chosen)
    if sin is not None and cos is not None:
        pole = np.arctan2(sin, cos)
    if pole is not None:
        joints["pole"] = pole * (1 - 2 * columns.invert_pole) + ZEROS[columns.pole_zero]
    return joints


def _read_velocities(table: Table, columns: Columns, chosen: Mask) -> dict[str, Floats]:
    """Return joint -> reported velocities in the rows taken, m/s and rad/s."""
    velocities = {}
    cart = _read_channel(table, columns.cart_velocity, "--cart-velocity", chosen)
    if cart is not None:
        unit = LENGTH_UNITS[columns.length_unit]
        velocities["cart"] = cart * unit * (1 - 2 * columns.invert_cart)
    pole = _read_channel(table, columns.pole_velocity, "--pole-velocity", chosen)
    if pole is not None:
        unit = ANGLE_UNITS[columns.angle_unit]
        velocities["pole"] = pole * unit * (1 - 2 * columns.invert_pole)
    return velocities


def _read_channel(table: Table, name: str | None, option: str, chosen: Mask) -> Floats | None:
    """Return the rows taken of a column, None where none is named."""
    if name is None:
        return None
    values = table.get_column(name, option)[chosen]
    missing = np.count_nonzero(~np.isfinite(values))
    if missing > decisions.MOST_NOT_FINITE * len(values):
        raise FileError(
            f"expected finite numbers in column {name}, found {missing} of {len(values)} "
            "cells empty, nan or "
            f"infinite: at most {decisions.MOST_NOT_FINITE:.0%} can be done without"
        )
    return values


def _describe(stamps_ns: Ints, joints: dict[str, Floats], command: Floats | None) -> Imported:
    channels = joints if command is None else {"command": command, **joints}
    ranges = {
        name: (float(np.min(finite)), float(np.max(finite)))
        for name, values in channels.items()
        if len(finite := values[np.isfinite(values)])
    }
    begins = None
    if "pole" in joints:
        early = joints["pole"][np.isfinite(joints["pole"])][: decisions.SPIKE_SIDE_STEPS]
        begins = float(np.median(early)) % (2.0 * math.pi)
    return Imported(len(stamps_ns), float(stamps_ns[-1]) * 1e-9, ranges, begins)


def _list_doubts(imported: Imported) -> tuple[str, ...]:
    """Return sentences about a length and a rate that no verb takes."""
    doubts = []
    if (
        imported.rows < decisions.LEAST_SAMPLES
        or imported.rows < decisions.LEAST_SECONDS * imported.rate_hz
    ):
        doubts.append(
            f"expected at least {decisions.LEAST_SAMPLES} samples and "
            f"{decisions.LEAST_SECONDS:g} s, found {imported.rows} samples in "
            f"{imported.seconds:.3g} s: no verb takes so short a recording"
        )
    if not decisions.LOWEST_RATE_HZ <= imported.rate_hz <= decisions.HIGHEST_RATE_HZ:
        doubts.append(
            f"expected {decisions.LOWEST_RATE_HZ:g} to {decisions.HIGHEST_RATE_HZ:g} "
            f"rows a second, found {imported.rate_hz:.4g}: is it another --time-unit?"
        )
    return tuple(doubts)
