"""The verb `import`: columns of files as recordings."""

from __future__ import annotations

import argparse
from dataclasses import asdict, fields
from pathlib import Path

from pendulum_sysid.errors import WrongUse
from pendulum_sysid.finding.stages import Stage
from pendulum_sysid.reading.columns import Columns, find_clock_refusal
from pendulum_sysid.reading.csv_import import Imported, import_csv, import_segments
from pendulum_sysid.reading.ros1 import import_ros1_bag, is_ros1_bag
from pendulum_sysid.verbs.said import ANSWERED, print_answer, say

UNITS = {"command": "", "cart": " m", "pole": " rad"}


def run(arguments: argparse.Namespace) -> int:
    """Write the recordings; print their names and what was read."""
    if all(is_ros1_bag(file) for file in arguments.csv):
        return import_bags(arguments)
    if arguments.cart is None and arguments.pole is None and arguments.sin is None:
        arguments.parser.error("expected --cart, --pole or both, found neither")
    if refusal := find_clock_refusal(arguments.time, arguments.rate_hz):
        arguments.parser.error(refusal)
    columns = Columns(**{f.name: getattr(arguments, f.name) for f in fields(Columns)})
    lines: list[object] = []
    mappings = []
    for file, out in _name_recordings(arguments).items():
        arguments.progress.report(Stage.READING)
        recordings = (
            {out: import_csv(file, out, columns)}
            if columns.segment is None
            else import_segments(file, out, columns)
        )
        for recording, imported in recordings.items():
            lines += [recording, *describe(imported)]
            mappings.append({"file": str(file), "recording": str(recording), **asdict(imported)})
            for warning in imported.warnings:
                say(f"warning: {recording}: {warning}", ANSWERED)
    print_answer(arguments, lambda: {"recordings": mappings}, *lines)
    return ANSWERED


def import_bags(arguments: argparse.Namespace) -> int:
    """Convert bags of ROS 1; print their names and topics."""
    lines: list[object] = []
    mappings = []
    for file, out in _name_recordings(arguments).items():
        arguments.progress.report(Stage.READING)
        topics = import_ros1_bag(file, out)
        lines += [out, *(f"{name} {kind} {count}" for name, (kind, count) in topics.items())]
        mappings.append({"file": str(file), "recording": str(out), "topics": topics})
    print_answer(arguments, lambda: {"recordings": mappings}, *lines)
    return ANSWERED


def _name_recordings(arguments: argparse.Namespace) -> dict[Path, Path]:
    """Return file -> where its recording goes; raise WrongUse where two would go to one place."""
    files: list[Path] = arguments.csv
    if len(files) == 1:
        return {files[0]: arguments.out}
    places: dict[Path, Path] = {}
    for file in files:
        place = arguments.out / file.stem
        if place in places:
            raise WrongUse(
                f"{file}: expected files of different names, found that {places[place]} becomes "
                f"{place}, too: import them one by one"
            )
        places[place] = file
    return {file: place for place, file in places.items()}


def describe(imported: Imported) -> list[str]:
    """Return lines that say what was read."""
    lines = [f"{imported.rows} rows in {imported.seconds:.6g} s: {imported.rate_hz:.5g} Hz"]
    for name, (low, high) in imported.ranges.items():
        line = f"{name} from {low:.4g} to {high:.4g}{UNITS[name]}"
        if name == "pole":
            line += f"; begins at {imported.begins_at_rad:.3g} rad (0 upright, 3.14 hanging)"
        lines.append(line)
    return lines
