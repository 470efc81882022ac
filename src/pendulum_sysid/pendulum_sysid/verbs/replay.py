"""The verb `replay`: how well a twin runs on recordings."""

from __future__ import annotations

import argparse
import math
from dataclasses import astuple
from pathlib import Path
from typing import Any

from pendulum_sysid.finding.stages import Stage
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.compare import compare
from pendulum_sysid.plausibility.ask import list_plausibility_warnings
from pendulum_sysid.prepare import prepare_case
from pendulum_sysid.records import Comparison
from pendulum_sysid.telling.tables import format_table, make_comparison_rows
from pendulum_sysid.verbs.recordings import read_recordings
from pendulum_sysid.verbs.said import ANSWERED, print_answer, say
from pendulum_twin.model import load_twin


def run(arguments: argparse.Namespace) -> int:
    """Print the twin's errors on all recordings together."""
    twin = load_twin(arguments.twin)
    arguments.progress.report(Stage.READING)
    case = prepare_case(read_recordings(arguments.bag, arguments), twin)
    say_doubts(case)
    comparison = compare(case)
    say_if_diverged(arguments.twin, comparison)
    print_answer(
        arguments,
        lambda: make_mapping(comparison),
        f"{comparison.count} windows of {comparison.seconds:g} s",
        format_table(("measure", str(arguments.twin), "unit"), make_comparison_rows([comparison])),
    )
    return ANSWERED


def make_mapping(comparison: Comparison) -> dict[str, Any]:
    """Return what `--json` prints."""
    windows = {
        "seconds": comparison.seconds,
        "count": comparison.count,
        "cart_rmse_m": comparison.cart_rmse_m,
        "pole_rmse_rad": comparison.pole_rmse_rad,
        "score": comparison.score,
        "noise_floor": comparison.noise_floor,
    }
    return {"windows": windows, "whole": {"thesis_rmse": comparison.thesis_rmse}}


def say_doubts(case: Case) -> None:
    """Say why the recordings may not be the rig's: errors are told of any recording."""
    for warning in list_plausibility_warnings(case):
        say(f"before you believe the errors: {warning}", ANSWERED)


def say_if_diverged(name: Path, comparison: Comparison) -> None:
    """Say that a twin's errors are no numbers, if they are not."""
    if not all(math.isfinite(value) for value in astuple(comparison) if value is not None):
        say(f"{name}: a run of this twin diverged, so that its error is no number (JSON: null)")
