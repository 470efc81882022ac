"""The given twin as a candidate: it stays where an improved twin does not run better for sure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.finding.judge import average_over_blocks, compute_lead
from pendulum_sysid.finding.search import Answer
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.gauss_newton import refine_start_states
from pendulum_sysid.fitting.linearised import FAR
from pendulum_sysid.fitting.parameters import convert_distance
from pendulum_sysid.fitting.window_runs import WindowRuns
from pendulum_sysid.fitting.windows import shorten_windows
from pendulum_sysid.records import Fit, Split
from pendulum_twin.arrays import Floats
from pendulum_twin.parameter_vector import make_theta


def find_given_twin(case: Case, split: Split, best: Fit, behind: bool) -> Fit | None:
    """Return the given twin as a fit where it stays; None where the improved twin is better.

    It stays where the improved twin is surely behind, and where a fit that changes values of the
    given twin alone gains nothing by it.

    best: the fit of the improved twin.
    behind: whether the improved twin is surely behind.
    """
    if not behind and set(best.effects) - set(case.twin.effects):
        return None
    given = _fit_given_twin(case, split, best)
    return given if behind or _is_ahead_by_chance(best, given) else None


def _is_ahead_by_chance(best: Fit, given: Fit) -> bool:
    """Return whether a fit is ahead of the given twin by no more than chance.

    Each window is judged by values that were fitted to other windows. The given twin has nothing
    to fit, so a refit of a true twin is behind by its errors of estimation. No ratio of misfits is
    asked for: a refit that is a little better, and more than chance is, stays.
    """
    lead = compute_lead(best, given)
    return bool(lead.standard_errors < decisions.LEAD_STANDARD_ERRORS)


def is_surely_behind(improved: WindowRuns, given: WindowRuns) -> bool:
    """Return whether the improved twin's errors are larger on windows that nobody has used.

    improved, given: free runs of both twins on the same windows.

    As in `judge.compute_lead`, windows are compared pair by pair under a heavy-tailed likelihood,
    and blocks of time say what is chance.
    """
    power = [np.minimum(runs.window_rmse / runs.noise, FAR) ** 2 for runs in (improved, given)]
    typical = np.median(power[1], axis=0)
    losses = _compute_log_errors(power[0], typical) - _compute_log_errors(power[1], typical)
    blocks = average_over_blocks(losses)
    if len(blocks) < 2:
        return False
    spread = float(np.std(blocks, ddof=1)) / np.sqrt(len(blocks))
    return bool(np.mean(losses) > decisions.LEAD_STANDARD_ERRORS * max(spread, 1e-12))


def _compute_log_errors(power: Floats, typical: Floats) -> Floats:
    """Return the logarithm of each window's error, (windows,), the mean of its channels."""
    return np.asarray(np.mean(0.5 * np.log1p(power / typical), axis=1))


def _fit_given_twin(case: Case, split: Split, best: Fit) -> Fit:
    """Return the given twin as a fit: its errors, beside the values that another fit estimates.

    best: the other fit. What detectors have read off the recording beside it stays in the twin.
    """
    read = {
        name: best.twin.effects[name] for name in best.twin.effects if name not in best.effects
    }
    twin = replace(case.twin, effects={**case.twin.effects, **read})
    problem = case.problem(shorten_windows(case.state, split.learn, best.pieces))
    runs = refine_start_states(problem, make_theta(twin))
    return replace(
        best,
        twin=twin,
        effects=tuple(case.twin.effects),
        estimates=convert_distance(best.estimates, case.twin, best.twin),
        theta=runs.theta,
        start_states=runs.start_states,
        power=runs.power,
        train=runs.misfit(case.noise),
        choose=runs.misfit(case.noise),
        window_squares=runs.squares,
        counts=runs.counts,
    )


def take_given_twin(answer: Answer, given: Fit) -> Answer:
    """Return the answer with the given twin in the place of the improved twin.

    What detectors have read off the recording keeps its name; no other effect has a name then.
    """
    named = tuple(effect for effect in answer.named if effect.effect in given.twin.effects)
    return replace(answer, best=given, named=named, perhaps=(), ties=())
