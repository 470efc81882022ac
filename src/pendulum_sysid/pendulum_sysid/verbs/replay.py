"""The verb `replay`: how well a twin runs on a recording."""

from __future__ import annotations

import argparse
import math
from dataclasses import astuple
from pathlib import Path
from typing import Any

from pendulum_sysid.fitting.compare import compare
from pendulum_sysid.prepare import prepare_case
from pendulum_sysid.records import Comparison
from pendulum_sysid.telling.output_files import format_json
from pendulum_sysid.telling.tables import format_table, make_comparison_rows
from pendulum_sysid.verbs.recordings import read_recordings
from pendulum_sysid.verbs.said import ANSWERED, say
from pendulum_twin.model import load_twin


def run(arguments: argparse.Namespace) -> int:
    """Print the twin's errors on the recording."""
    twin = load_twin(arguments.twin)
    found = compare(prepare_case(read_recordings([arguments.bag], arguments), twin))
    say_if_diverged(arguments.twin, found)
    if arguments.json:
        print(format_json(make_mapping(found)))
    else:
        print(f"{found.count} windows of {found.seconds:g} s")
        print(
            format_table(("measure", str(arguments.twin), "unit"), make_comparison_rows([found]))
        )
    return ANSWERED


def make_mapping(found: Comparison) -> dict[str, Any]:
    """Return what `--json` prints."""
    windows = {
        "seconds": found.seconds,
        "count": found.count,
        "cart_rmse_m": found.cart_rmse_m,
        "pole_rmse_rad": found.pole_rmse_rad,
        "score": found.score,
    }
    return {"windows": windows, "whole": {"thesis_rmse": found.thesis_rmse}}


def say_if_diverged(name: Path, found: Comparison) -> None:
    """Say that a twin's errors are no numbers, if they are not."""
    if not all(math.isfinite(value) for value in astuple(found) if value is not None):
        say(f"{name}: a run of this twin diverged, so that its error is no number (JSON: null)")
