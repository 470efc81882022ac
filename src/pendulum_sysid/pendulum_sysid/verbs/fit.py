"""The verb `fit`: fit the twin's own parameters, by windows or by the thesis's procedure."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any

from pendulum_sysid import decisions
from pendulum_sysid.errors import WrongUse
from pendulum_sysid.finding.stages import Stage
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.fit import fit_own_parameters
from pendulum_sysid.fitting.noise_floor import measure_noise_floor
from pendulum_sysid.fitting.parameters import hold_constants
from pendulum_sysid.fitting.thesis_fit import MOST_EVALUATIONS, fit_as_thesis
from pendulum_sysid.fitting.window_runs import WindowRuns, run_windows
from pendulum_sysid.plausibility.ask import list_plausibility_doubts
from pendulum_sysid.prepare import prepare_case, prepare_windows
from pendulum_sysid.records import Windows
from pendulum_sysid.telling.output_files import check_file, name_write_errors
from pendulum_sysid.telling.tables import (
    ESTIMATES,
    format_number,
    format_table,
    look_up_value,
    make_estimate_rows,
    make_held_out_rows,
)
from pendulum_sysid.verbs.recordings import read_recordings
from pendulum_sysid.verbs.said import ANSWERED, print_answer, say
from pendulum_twin.model import Twin, load_twin, save_twin
from pendulum_twin.parameter_vector import make_theta

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Fitted:
    """Hold what a fit ends at, in the two forms in which it is told.

    twin: the fitted twin.
    text: tables for a person.
    mapping: what --json prints of the fit, in JSON's types.
    """

    twin: Twin
    text: str
    mapping: dict[str, Any]


def run(arguments: argparse.Namespace) -> int:
    """Fit, print what moved and how well the twin runs now, and write it."""
    if arguments.method == "windows" and arguments.max_evaluations is not None:
        arguments.parser.error("--max-evaluations goes with --method thesis")
    if arguments.method == "thesis" and arguments.hold:
        arguments.parser.error(
            "--hold goes with --method windows: the thesis's procedure fits all its parameters"
        )
    check_file(arguments.out)
    twin = hold_constants(load_twin(arguments.twin), arguments.hold)
    report = arguments.progress.report
    report(Stage.READING)
    case = prepare_case(read_recordings(arguments.bag, arguments), twin)
    for doubt in list_plausibility_doubts(case):
        say(f"before you use the twin: {doubt}", ANSWERED)
    if arguments.method == "windows":
        fitted = fit_by_windows(case, report)
    else:
        fitted = fit_by_thesis(case, arguments.max_evaluations or MOST_EVALUATIONS, report)
    with name_write_errors(arguments.out):
        save_twin(fitted.twin, arguments.out)
    print_answer(
        arguments,
        lambda: {"method": arguments.method, **fitted.mapping, "file": str(arguments.out)},
        fitted.text,
        f"\n{arguments.out}",
    )
    return ANSWERED


def fit_by_windows(case: Case, report: Progress) -> Fitted:
    """Fit the twin to windows; return it with its parameters and errors on held-out windows."""
    prepared = prepare_windows(case)
    case, windows = prepared.case, prepared.split
    report(f"fitting {len(windows.learn)} windows")
    result = fit_own_parameters(case, windows)
    if not result.estimates:
        raise WrongUse(
            "expected a parameter to fit, found all of them held: hold fewer (--hold, or sd: 0 in "
            "the twin file)"
        )
    cases = case, replace(case, twin=result.twin)
    before, after = (run_windows(each, windows.held_out) for each in cases)
    floors = _measure_floor(cases[0], windows.held_out), _measure_floor(cases[1], windows.held_out)
    if not result.converged:
        say(
            "the fit stopped before it had settled: more may be gained by fitting again from its "
            "result",
            ANSWERED,
        )
    if after.score > before.score:
        say(explain_worse_fit(after.score, floors[1]), ANSWERED)
    rows = make_held_out_rows(before, after, floors)
    text = "\n".join(
        (
            format_table(ESTIMATES, make_estimate_rows(case.twin, result)),
            f"\n{len(windows.held_out)} held-out windows, which the fit has not seen",
            format_table(("", "before", "after", "unit"), rows),
        )
    )
    estimates = {
        name: {"before": look_up_value(case.twin, name)[0], **asdict(estimate)}
        for name, estimate in result.estimates.items()
    }
    held_out = {
        "windows": len(windows.held_out),
        "before": _map_runs(before, floors[0]),
        "after": _map_runs(after, floors[1]),
    }
    mapping = {"converged": result.converged, "parameters": estimates, "held_out": held_out}
    return Fitted(result.twin, text, mapping)


def explain_worse_fit(score: float, floor: float | None) -> str:
    """Return why a fit is worse on held-out windows than the twin that it started from.

    score: of the fitted twin there.
    floor: the score of a perfect model; None where it cannot be measured.
    """
    if floor is not None and score <= decisions.FLOORS_AT_NOISE * floor:
        return (
            "the fit is no better on windows it has not seen: the given twin is at the noise "
            "there, so keep it"
        )
    return (
        "the fit is worse on windows it has not seen: no parameter repairs what is missing; ask "
        "sysid diagnose"
    )


def _measure_floor(case: Case, windows: Windows) -> float | None:
    floor = measure_noise_floor(case, make_theta(case.twin), windows)
    return None if floor is None else floor.score


def _map_runs(runs: WindowRuns, floor: float | None) -> dict[str, float | None]:
    """Return the errors of free runs by the keys of `sysid replay --json`."""
    return {
        "cart_rmse_m": runs.of_joint(0, runs.rmse),
        "pole_rmse_rad": runs.of_joint(1, runs.rmse),
        "score": runs.score,
        "noise_floor": floor,
    }


def fit_by_thesis(case: Case, most_evaluations: int, report: Progress) -> Fitted:
    """Fit the twin as the thesis does; return it with its parameters and equation 29."""
    result = fit_as_thesis(case, report, most_evaluations)
    if result.dropped:
        say(
            "left out, for the thesis's model has no such effect or measured law: "
            f"{', '.join(result.dropped)}",
            ANSWERED,
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
    end = "settled" if result.converged else "stopped at the limit, not settled"
    text = "\n".join(
        (
            format_table(("parameter", "start", "fitted", "moved by %", "unit", ""), rows),
            f"\nequation 29 on the fitted record: {format_number(result.before)} before, "
            f"{format_number(result.after)} after",
            f"{result.evaluations} evaluations, {end}; nothing was held out",
        )
    )
    mapping = {
        "converged": result.converged,
        "evaluations": result.evaluations,
        "parameters": {
            m.name: {"before": m.start, "value": m.fitted, "unit": m.unit, "at_bound": m.at_bound}
            for m in result.moved
        },
        "thesis_rmse": {"before": result.before, "after": result.after},
    }
    return Fitted(result.twin, text, mapping)
