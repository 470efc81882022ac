"""The verb `next`: plan the next experiment from recordings and an earlier diagnosis."""

from __future__ import annotations

import argparse
from dataclasses import dataclass, field, replace

import numpy as np

from pendulum_sysid.finding.identifiability import find_ties
from pendulum_sysid.finding.separation import Tie
from pendulum_sysid.finding.settled_search import search_settled, settle_commands
from pendulum_sysid.finding.stages import Stage
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.fit import HORIZONS, fit, fit_over_horizon
from pendulum_sysid.planning.next_experiment import (
    CHANGED,
    check_seconds,
    plan_next_experiment,
)
from pendulum_sysid.planning.repeating import repeat_plan
from pendulum_sysid.prepare import prepare
from pendulum_sysid.reading.earlier_verdict import EarlierVerdict, check_recordings, read_verdict
from pendulum_sysid.records import Fit, Next, Split
from pendulum_sysid.telling.output_files import check_file, name_write_errors
from pendulum_sysid.verbs.recordings import read_recordings
from pendulum_sysid.verbs.said import ANSWERED, print_answer, say
from pendulum_twin.arrays import Floats
from pendulum_twin.model import load_twin
from pendulum_twin.parameter_vector import make_theta
from pendulum_twin.plans.plan_file import parse_plan, save_plan

UNKNOWN = (np.nan, np.nan)  # ends of an interval that a verdict does not tell


@dataclass(frozen=True)
class Finished:
    """Hold a recording's case and windows, the fit with all that is named, and what ties it.

    bands: measured law of an earlier diagnosis -> (knots,) half widths of its band.
    rig_changed: whether the earlier diagnosis says that the rig changed between its recordings.
    """

    case: Case
    split: Split
    best: Fit
    ties: tuple[Tie, ...]
    bands: dict[str, Floats] = field(default_factory=dict)
    rig_changed: bool = False


def run(arguments: argparse.Namespace) -> int:
    """Print why to play what next, and write the plan where one helps."""
    check_file(arguments.out)
    check_seconds(arguments.seconds)
    done = _finish(arguments)
    arguments.progress.report(Stage.PLANNING)
    planned = CHANGED if done.rig_changed else _plan(done, arguments.goal, arguments.seconds)
    file = None
    if planned.plan is not None:
        file, plan = arguments.out, parse_plan(planned.plan)
        if arguments.repeat:
            plan = repeat_plan(plan, done.best.twin.rig)
        with name_write_errors(file):
            save_plan(plan, file)
    print_answer(
        arguments,
        lambda: {"why": planned.why, "file": None if file is None else str(file)},
        planned.why,
        *([] if file is None else [file]),
    )
    return ANSWERED


def _plan(done: Finished, goal: str | None, seconds: float) -> Next:
    return plan_next_experiment(
        done.case, done.split, done.best, done.ties, goal, seconds, bands=done.bands
    )


def _finish(arguments: argparse.Namespace) -> Finished:
    """Return what is named as an earlier diagnosis has it, or found now."""
    earlier = None if arguments.verdict is None else read_verdict(arguments.verdict)
    twin = load_twin(arguments.twin)
    if earlier is None:  # a search of its own has the stages of a diagnosis
        arguments.progress.follow_stages()
    arguments.progress.report(Stage.READING)
    recordings = read_recordings(arguments.bag, arguments)
    if earlier is not None:
        check_recordings(arguments.verdict, earlier, [each.digest for each in recordings])
        twin = twin.hold(earlier.known_constants)
    prepared = prepare(recordings, twin)
    for doubt in prepared.doubts:
        say(f"before you play the plan: {doubt}", ANSWERED)
    case, windows = prepared.case, prepared.split
    if earlier is not None:
        arguments.progress.report("fitting what the verdict names")
        theta = make_theta(earlier.twin)
        case, windows = settle_commands(case, windows, earlier.effects, theta)
        near = fit(case, windows, earlier.effects, theta, HORIZONS[0])
        best = take_intervals(fit_over_horizon(case, windows, near, HORIZONS[-1]), earlier)
        ties = find_ties(case, windows, best, earlier.rivals)
        return Finished(case, windows, best, ties, earlier.bands, earlier.rig_changed)
    case, windows, answer = search_settled(case, windows, arguments.progress.report)
    return Finished(case, windows, answer.best, answer.ties)


def take_intervals(fit: Fit, earlier: EarlierVerdict) -> Fit:
    """Return a fit whose intervals hold those of an earlier verdict.

    A diagnosis widens intervals where errors stay above the noise, and beside measured laws: its
    plan is for what the verdict says is not known.
    """
    estimates = {
        name: replace(
            estimate,
            low=np.fmin(estimate.low, earlier.intervals.get(name, UNKNOWN)[0]),
            high=np.fmax(estimate.high, earlier.intervals.get(name, UNKNOWN)[1]),
        )
        for name, estimate in fit.estimates.items()
    }
    return replace(fit, estimates=estimates)
