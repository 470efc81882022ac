"""How well an instant is known: as well as the windows that hold it, and their errors, tell it.

A run knows an instant only if its window holds it. So a sandwich of the windows' scores says
nothing: the few windows that know the instant are those that it was fitted to.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.problem import Problem, compute_errors
from pendulum_sysid.fitting.windows import shorten_windows
from pendulum_sysid.records import Estimate, Fit, Split, Windows
from pendulum_twin.arrays import Floats
from pendulum_twin.effects import CATALOGUE
from pendulum_twin.parameter_vector import SLOTS
from pendulum_twin.signals import Signals

PLACES = {  # of instants in theta
    f"{e.name}.{p.name}": SLOTS[e.name].start + k
    for e in CATALOGUE
    for k, p in enumerate(e.parameters)
    if p.instant
}
STEP_GROWTH = 1.5  # from one tried instant to the next, away from the estimate


def widen_over_gaps(
    estimates: dict[str, Estimate], signals: Signals, windows: Windows
) -> dict[str, Estimate]:
    """Return the estimates, instants no better than the windows that were fitted hold them.

    Between two windows every instant gives the same runs; a fit stops at the edge of the gap.
    """
    if not PLACES.keys() & estimates.keys():
        return estimates
    gaps = _list_gaps(signals, windows)

    def widen(estimate: Estimate) -> Estimate:
        touched = [
            (begin, end)
            for begin, end in gaps
            if begin - signals.period_s <= estimate.value <= end + signals.period_s
        ]
        return replace(
            estimate,
            low=min([estimate.low, *(begin for begin, _ in touched)]),
            high=max([estimate.high, *(end for _, end in touched)]),
        )

    return {name: widen(e) if name in PLACES else e for name, e in estimates.items()}


def widen_by_errors(case: Case, split: Split, fit: Fit) -> dict[str, Estimate]:
    """Return the estimates of a fit, instants no better than its errors tell them.

    An interval holds every instant whose runs are no worse than the fit by a likelihood ratio at
    95 %. Errors beyond the noise are alike all over a window: it counts as one sample of them.
    """
    names = PLACES.keys() & fit.estimates.keys()
    if not names:
        return fit.estimates
    problem = case.problem(shorten_windows(case.state, split.learn, fit.pieces))
    alike = 1.0 - min(1.0 / fit.choose, 1.0) ** 2
    most = decisions.INTERVAL_DEVIATIONS**2 * (1.0 + (problem.windows.samples - 1) * alike)
    widened = {}
    for name in names:
        estimate = fit.estimates[name]
        below, above = (
            _find_reach(problem, fit, PLACES[name], sign, most) for sign in (-1.0, 1.0)
        )
        widened[name] = replace(
            estimate,
            low=min(estimate.low, estimate.value - below),
            high=max(estimate.high, estimate.value + above),
        )
    return {**fit.estimates, **widened}


def _find_reach(problem: Problem, fit: Fit, place: int, sign: float, most: float) -> float:
    """Return how far, s, an instant can move before the errors grow by more than `most`.

    At most to the ends of the recording.
    """
    clock_s = problem.signals.clock_s
    end_s = float(clock_s.min() if sign < 0.0 else clock_s.max())
    furthest = max(sign * (end_s - float(fit.theta[place])), 0.0)
    own, step = _compute_squares(problem, fit, fit.theta), problem.signals.period_s
    while step < furthest:
        theta = fit.theta.copy()
        theta[place] += sign * step
        if _compute_squares(problem, fit, theta) - own > most:
            return step
        step *= STEP_GROWTH
    return furthest


def _compute_squares(problem: Problem, fit: Fit, theta: Floats) -> float:
    """Return the squared errors in units of the fit's own, of all windows and channels."""
    errors = compute_errors(problem, theta, fit.start_states)
    return float(np.sum(errors**2 / fit.power))


def _list_gaps(signals: Signals, windows: Windows) -> list[tuple[float, float]]:
    """Return begin and end, s, of all times that no window covers."""
    clock_s = signals.clock_s
    begins = np.sort(clock_s[windows.begin])
    reached = np.maximum.accumulate(begins + (windows.samples - 1) * signals.period_s)
    ends = [*begins.tolist(), max(float(np.max(clock_s)), float(reached[-1]))]
    starts = [min(float(np.min(clock_s)), float(begins[0])), *reached.tolist()]
    return [(start, end) for start, end in zip(starts, ends, strict=True) if start < end]
