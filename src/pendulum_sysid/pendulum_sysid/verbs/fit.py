"""The verb `fit`: fit the twin's own parameters, by windows or by the thesis's procedure."""

from __future__ import annotations

import argparse
from dataclasses import replace

from pendulum_sysid.fitting.fit import fit_own_parameters
from pendulum_sysid.fitting.parameters import hold_constants
from pendulum_sysid.fitting.thesis_fit import MOST_EVALUATIONS, fit_as_thesis
from pendulum_sysid.fitting.window_runs import run_windows
from pendulum_sysid.prepare import prepare, prepare_case
from pendulum_sysid.records import Recording
from pendulum_sysid.telling.output_files import check_file, name_write_errors
from pendulum_sysid.telling.tables import (
    ESTIMATES,
    format_number,
    format_table,
    make_estimate_rows,
    make_held_out_rows,
)
from pendulum_sysid.verbs.recordings import read_recordings
from pendulum_sysid.verbs.said import ANSWERED, print_progress
from pendulum_twin.model import Twin, load_twin, save_twin


def run(arguments: argparse.Namespace) -> int:
    """Fit, print what moved and how well the twin runs now, and write it."""
    if arguments.method == "windows" and arguments.max_evaluations is not None:
        arguments.parser.error("--max-evaluations goes with --method thesis")
    check_file(arguments.out)
    twin = hold_constants(load_twin(arguments.twin), arguments.hold)
    bags = read_recordings(arguments.bag, arguments)
    if arguments.method == "windows":
        fitted = fit_by_windows(bags, twin)
    else:
        fitted = fit_by_thesis(bags, twin, arguments.max_evaluations or MOST_EVALUATIONS)
    with name_write_errors(arguments.out):
        save_twin(fitted, arguments.out)
    print(f"\n{arguments.out}")
    return ANSWERED


def fit_by_windows(bags: list[Recording], twin: Twin) -> Twin:
    """Fit the twin to windows, and print its parameters and errors on held-out windows."""
    prepared = prepare(bags, twin)
    case, windows = prepared.case, prepared.split
    result = fit_own_parameters(case, windows)
    before, after = (
        run_windows(replace(case, twin=twin), windows.held_out)
        for twin in (case.twin, result.twin)
    )
    if not result.converged:
        print_progress(
            "the fit stopped before it had settled: more may be gained by fitting again from its "
            "result"
        )
    print(format_table(ESTIMATES, make_estimate_rows(case.twin, result)))
    if after.score > before.score:
        print_progress(
            "the fit is worse on windows it has not seen: no parameter repairs what is missing; "
            "ask sysid diagnose"
        )
    print(f"\n{len(windows.held_out)} held-out windows, which the fit has not seen")
    print(format_table(("", "before", "after", "unit"), make_held_out_rows(before, after)))
    return result.twin


def fit_by_thesis(bags: list[Recording], twin: Twin, most_evaluations: int) -> Twin:
    """Fit the twin as the thesis does, and print its parameters and equation 29."""
    result = fit_as_thesis(prepare_case(bags, twin), print_progress, most_evaluations)
    if result.dropped:
        print_progress(
            f"left out, for the thesis's model does not have it: {', '.join(result.dropped)}"
        )
    rows = [
        (
            m.name,
            format_number(m.start),
            format_number(m.fitted),
            format_number(m.percent, 3),
            m.unit,
            "at its bound" if m.at_bound else "",
        )
        for m in result.moved
    ]
    print(format_table(("parameter", "start", "fitted", "moved by %", "unit", ""), rows))
    end = "settled" if result.converged else "stopped at the limit, not settled"
    print(
        f"\nequation 29 on the fitted record: {format_number(result.before)} before, "
        f"{format_number(result.after)} after"
    )
    print(f"{result.evaluations} evaluations, {end}; nothing was held out")
    return result.twin
