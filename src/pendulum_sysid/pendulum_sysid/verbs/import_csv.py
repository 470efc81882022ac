"""The verb `import`: columns of files as recordings."""

from __future__ import annotations

import argparse
from dataclasses import asdict, fields
from pathlib import Path

from pendulum_sysid import decisions
from pendulum_sysid.finding.stages import Stage
from pendulum_sysid.reading.csv_import import Columns, Imported, import_csv
from pendulum_sysid.verbs.said import ANSWERED, print_answer, say

UNITS = {"command": "", "cart": " m", "pole": " rad"}


def run(arguments: argparse.Namespace) -> int:
    """Write the recordings; print their names and what was read."""
    if arguments.cart is None and arguments.pole is None and arguments.sin is None:
        arguments.parser.error("expected --cart, --pole or both, found neither")
    if (arguments.time is None) == (arguments.rate_hz is None):
        arguments.parser.error("expected --time COLUMN or --rate HZ, found both or neither")
    columns = Columns(**{f.name: getattr(arguments, f.name) for f in fields(Columns)})
    lines: list[object] = []
    mappings = []
    for file in arguments.csv:
        arguments.progress.report(Stage.READING.value)
        out: Path = arguments.out if len(arguments.csv) == 1 else arguments.out / file.stem
        imported = import_csv(file, out, columns)
        lines += [out, *describe(imported)]
        mappings.append({"file": str(file), "recording": str(out), **asdict(imported)})
        if not decisions.LOWEST_RATE_HZ <= imported.rate_hz <= decisions.HIGHEST_RATE_HZ:
            say(
                f"{file}: expected {decisions.LOWEST_RATE_HZ:g} to {decisions.HIGHEST_RATE_HZ:g} "
                f"rows a second, found {imported.rate_hz:.4g}: is it another --time-unit?"
            )
    print_answer(arguments, lambda: {"recordings": mappings}, *lines)
    return ANSWERED


def describe(imported: Imported) -> list[str]:
    """Return lines that say what was read."""
    lines = [f"{imported.rows} rows in {imported.seconds:.6g} s: {imported.rate_hz:.5g} Hz"]
    for name, (low, high) in imported.ranges.items():
        line = f"{name} from {low:.4g} to {high:.4g}{UNITS[name]}"
        if name == "pole":
            line += f"; begins at {imported.begins_at_rad:.3g} rad (0 upright, 3.14 hanging)"
        lines.append(line)
    return lines
