"""Check over whole windows that a law of one half of the time holds in the other half.

The folds of cross-validation take every fifth window, so each fold holds a part of whatever lasts
for some seconds. No windows of one recording are more like the next recording than its other half.

The law alone is taken from half to half, and all other parameters follow. Constants and laws that
still lack something differ between halves, and hide what one law does. A half says nothing of the
places where it never was: there the law stays as the fit to all windows has it, and what the law
gains there no other half confirms.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.finding.judge import compute_log_errors
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.cross_validation import fit_without
from pendulum_sysid.fitting.gauss_newton import refine_start_states
from pendulum_sysid.fitting.linearised import System, linearise
from pendulum_sysid.fitting.windows import shorten_windows
from pendulum_sysid.measuring.curve import Curve
from pendulum_sysid.measuring.penalised_fit import (
    LawFit,
    list_all_free,
    list_parts,
    make_penalty,
)
from pendulum_sysid.records import Fit, Split, Windows
from pendulum_twin.arrays import Floats, Ints, Mask
from pendulum_twin.effects import BY_NAME
from pendulum_twin.laws.law import locate_on_knots


def is_seen_in_halves(case: Case, split: Split, longer: LawFit, shorter: LawFit) -> bool:
    """Return whether the halves run better with each other's laws, and neither surely worse.

    Better by more than a standard error: of two models that do about as well the simpler is
    taken (Hastie, Tibshirani and Friedman, The Elements of Statistical Learning (2009), section
    7.10). Each half counts by its own standard error (Stouffer's method), for a half that hardly
    shows the law scatters by other physics.

    Of a law over the time one half does not tell the other half's values: both halves are run with
    the values of the whole.

    longer: a fit with the laws of the shorter fit, and with those that are asked.
    """
    known = {curve.kind.name for curve in shorter.curves}
    rich, simple = (_run_halves(case, split, law_fit, known) for law_fit in (longer, shorter))
    gains = (compute_log_errors(simple, rich) - compute_log_errors(rich, rich)).mean(axis=1)
    halves = [_measure_in_errors(gains[half]) for half in _list_halves(len(gains))]
    both = float(np.sum(halves) / np.sqrt(len(halves)))
    is_worse = min(halves) < -decisions.INTERVAL_DEVIATIONS
    return both > decisions.LAW_LEAST_ERRORS and not is_worse


def _measure_in_errors(gains: Floats) -> float:
    """Return the mean of gains (windows,) in its standard errors; 0 for a window alone."""
    if len(gains) < 2:
        return 0.0
    return float(np.mean(gains) * np.sqrt(len(gains)) / max(np.std(gains, ddof=1), 1e-300))


def _list_halves(count: int) -> tuple[Mask, Mask]:
    """Return which of `count` windows, in the order of time, lie in each half."""
    early = np.arange(count) < count // 2
    return early, ~early


def _is_timed(name: str) -> bool:
    """Return whether a free parameter is of an effect of the time."""
    effect = BY_NAME.get(name.partition(".")[0])
    return effect is not None and effect.timed


def _run_halves(case: Case, split: Split, law_fit: LawFit, known: Collection[str]) -> Fit:
    """Return a fit with the errors of whole windows, each half run with the other half's laws.

    The fits to a half are Gauss-Newton steps from the fit to all (`fit_without`). Effects and laws
    of the time since the recording began stay as they are: one half does not tell them.

    known: kinds of laws that follow in each half, as constants and effects do.
    """
    fit, curves = law_fit.fit, law_fit.curves
    problem = case.problem(shorten_windows(case.state, split.learn, fit.pieces))
    free = list_all_free(case, fit.effects, fit.theta, curves)
    system = law_fit.system or linearise(problem, fit.theta, fit.start_states, free, fit.power)
    parts = list(zip(curves, list_parts(len(free), curves), strict=True))
    own = len(free) - sum(len(curve.knots) for curve in curves)
    penalty = make_penalty(len(free), curves, law_fit.priors, law_fit.inflation)
    everything = range(len(free))
    timed = {k for k in everything[:own] if _is_timed(free[k].name)}
    timed |= {k for curve, part in parts if curve.kind.timed for k in everything[part]}
    carried = {
        k for curve, part in parts if curve.kind.name not in known for k in everything[part]
    }
    moving = [k for k in everything if k not in timed]
    following = [k for k in moving if k not in carried]
    taken = [k for k in moving if k in carried]

    def fit_part(system: System, columns: list[int], left_out: Mask) -> Floats:
        """Return theta (SIZE,) with some parameters fitted to the windows that stay."""
        chosen = tuple(free[k] for k in columns)
        inner = penalty[np.ix_(columns, columns)]
        return fit_without(system.pick(columns), fit, chosen, left_out, inner)[0]

    squares, counts = [], []
    for half in _list_halves(len(split.learn.begin)):
        left_out = np.repeat(half, fit.pieces)
        other = fit_part(system, moving, left_out)
        visited = _list_visited(parts, split.learn.pick(~half))
        values = np.array([free[k].get(other if k in visited else fit.theta) for k in taken])
        steps = values - [free[k].get(fit.theta) for k in taken]
        moved = system.move(taken, steps / [free[k].size for k in taken])
        theta = fit_part(moved, following, ~left_out)
        for k, value in zip(taken, values, strict=True):
            free[k].put(theta, value)
        run = refine_start_states(case.problem(split.learn.pick(half)), theta)
        squares.append(run.squares)
        counts.append(run.counts)
    return replace(
        fit, window_squares=np.concatenate(squares), counts=np.concatenate(counts), pieces=1
    )


def _list_visited(parts: Sequence[tuple[Curve, slice]], windows: Windows) -> set[int]:
    """Return which free parameters are values of laws at places that windows visit.

    All values of a law whose values act longer than the visit: of a command, and of hysteresis.

    parts: curves, and where their values lie among the free parameters.
    """
    samples = (windows.begin[:, None] + np.arange(windows.samples)).ravel()
    visited = set[int]()
    for curve, part in parts:
        count = len(curve.knots)
        near: Ints = np.arange(count)
        if curve.acts is not None:
            z = locate_on_knots(curve.kind, curve.knots, curve.seen[samples])
            near = np.concatenate([np.floor(z), np.ceil(z)]).astype(int)
            near = near % count if curve.kind.is_periodic else near.clip(0, count - 1)
        visited |= {part.start + k for k in np.unique(near).tolist()}
    return visited
