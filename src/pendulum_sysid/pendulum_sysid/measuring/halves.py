"""Check over whole windows that a law of one half of the time holds in the other half.

The folds of cross-validation take every fifth window, so each fold holds a part of whatever lasts
for some seconds. No windows of one recording are more like the next recording than its other half.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pendulum_sysid.finding.judge import compute_log_errors
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.cross_validation import fit_without
from pendulum_sysid.fitting.gauss_newton import refine_start_states
from pendulum_sysid.fitting.linearised import linearise
from pendulum_sysid.fitting.windows import shorten_windows
from pendulum_sysid.measuring.penalised_fit import LawFit, list_all_free, make_penalty
from pendulum_sysid.records import Fit, Split
from pendulum_twin.arrays import Mask
from pendulum_twin.effects import BY_NAME


def is_seen_in_halves(case: Case, split: Split, longer: LawFit, shorter: LawFit) -> bool:
    """Return whether a fit with one law more runs each half better, fitted to the other half."""
    rich, simple = (_run_halves(case, split, law_fit) for law_fit in (longer, shorter))
    gains = (compute_log_errors(simple, rich) - compute_log_errors(rich, rich)).mean(axis=1)
    return all(np.mean(gains[half]) > 0.0 for half in _list_halves(len(gains)))


def _list_halves(count: int) -> tuple[Mask, Mask]:
    """Return which of `count` windows, in the order of time, lie in each half."""
    early = np.arange(count) < count // 2
    return early, ~early


def _is_timed(name: str) -> bool:
    """Return whether a free parameter is of an effect of the time."""
    effect = BY_NAME.get(name.partition(".")[0])
    return effect is not None and effect.timed


def _run_halves(case: Case, split: Split, law_fit: LawFit) -> Fit:
    """Return a fit with the errors of whole windows, each half run by a fit to the other.

    The fit to a half is a Gauss-Newton step from the fit to all (`fit_without`). Effects of the
    time since the recording began keep their sizes: one half does not tell them.
    """
    fit, curves = law_fit.fit, law_fit.curves
    problem = case.problem(shorten_windows(case.state, split.learn, fit.pieces))
    free = list_all_free(case, fit.effects, fit.theta, curves)
    system = law_fit.system or linearise(problem, fit.theta, fit.start_states, free, fit.power)
    own = len(free) - sum(len(curve.knots) for curve in curves)
    penalty = make_penalty(own, curves, law_fit.priors, law_fit.inflation)
    moving = [k for k, parameter in enumerate(free) if not _is_timed(parameter.name)]
    free, penalty = tuple(free[k] for k in moving), penalty[np.ix_(moving, moving)]
    system = system.pick(moving)
    squares, counts = [], []
    for half in _list_halves(len(split.learn.begin)):
        theta, _ = fit_without(system, fit, free, np.repeat(half, fit.pieces), penalty)
        run = refine_start_states(case.problem(split.learn.pick(half)), theta)
        squares.append(run.squares)
        counts.append(run.counts)
    return replace(
        fit, window_squares=np.concatenate(squares), counts=np.concatenate(counts), pieces=1
    )
