"""Cross-validate a fit: each window is judged by parameters that were fitted to other windows.

The fit to the other windows is a Gauss-Newton step from the fit to all of them, as for the
leave-out formulas of linear regression (Hastie, Tibshirani and Friedman, The Elements of
Statistical Learning (2009), section 7.10). A window's own start state follows to first order;
near upright, where it follows its parameters on no straight line, it is fitted again. A step after
which the other windows are worse is shortened: an edge, or a belt that stretches a little, follows
its parameters on no straight line either.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.fitting.gauss_newton import (
    Solution,
    compute_misfit,
    measure_belief,
    measure_penalty,
    take_step,
)
from pendulum_sysid.fitting.linearised import FAR, System, linearise
from pendulum_sysid.fitting.parameters import Free
from pendulum_sysid.fitting.problem import Problem, compute_errors, list_varied
from pendulum_sysid.records import Fit
from pendulum_twin.arrays import Floats, Mask

# Of a parameter's own weight: the first bounds the step along what the other windows leave open.
DAMPINGS = (1e-3, 0.1, 10.0)
ROUNDING = 1e-6  # relative; of costs that are the same
START_ITERATIONS = 2  # from start states that have followed to first order


def cross_validate(
    problem: Problem,
    solution: Solution,
    free: tuple[Free, ...],
    together: int = 1,
    penalty: Floats | None = None,
) -> Floats:
    """Return the sum of squared errors of each window, (windows, channels), m^2 or rad^2.

    solution: the fit to all windows of the problem.
    together: how many windows in a row are pieces of one longer window, left out together.
    penalty: (parameters, parameters) of a fit that holds its parameters near 0, in their sizes;
        None for none.

    Folds take every n-th longer window, so that each fold sees every regime of the recording.
    """
    system = solution.system
    if system is None:
        return solution.squares
    count = len(solution.start_states)
    fold = (np.arange(count) // together) % decisions.FOLDS
    folds = [k for k in range(decisions.FOLDS) if 0 < np.sum(fold == k) < count]
    if len(folds) < 2:
        return solution.squares
    squares, tame = solution.squares.copy(), find_tame(system)
    for k in folds:
        theta, starts = _step_without(problem, solution, free, fold == k, tame, penalty)
        for part, iterations in ((fold == k) & tame, 0), ((fold == k) & ~tame, START_ITERATIONS):
            if part.any():
                left_out = replace(problem, windows=problem.windows.pick(part))
                squares[part] = _fit_starts(
                    left_out, theta, starts[part], solution.power, iterations
                )
    far = FAR**2 * problem.windows.samples * solution.power
    return np.minimum(np.nan_to_num(squares, nan=np.inf), far)


def _step_without(
    problem: Problem,
    solution: Solution,
    free: tuple[Free, ...],
    left_out: Mask,
    tame: Mask,
    penalty: Floats | None,
) -> tuple[Floats, Floats]:
    """Return theta and start states after the longest step that the other windows gain by.

    left_out, tame: (windows,).
    """
    assert solution.system is not None
    part = ~left_out & tame
    staying = replace(problem, windows=problem.windows.pick(part))

    def measure(theta: Floats, squares: Floats, starts: Floats) -> float:
        """Return the cost of the windows that stay, of which a step is the minimum."""
        restraint = measure_belief(free, theta) + measure_penalty(free, theta, penalty)
        off = _count_deviations(staying, starts)
        return float(np.sum(squares / solution.power) + np.sum(off) + restraint)

    known = measure(solution.theta, solution.squares[part], solution.start_states[part])
    for damping in DAMPINGS:
        theta, starts = fit_without(solution.system, solution, free, left_out, penalty, damping)
        with np.errstate(all="ignore"):
            squares = np.sum(compute_errors(staying, theta, starts[part]) ** 2, axis=1)
        if measure(theta, squares, starts[part]) <= known * (1 + ROUNDING):
            return theta, starts
    return solution.theta, solution.start_states


def fit_without(
    system: System,
    known: Solution | Fit,
    free: tuple[Free, ...],
    left_out: Mask,
    penalty: Floats | None = None,
    damping: float = DAMPINGS[0],
) -> tuple[Floats, Floats]:
    """Return theta and start states of a fit without some of the windows.

    system: the normal equations of the fit to all windows.
    known: the fit to all windows.
    left_out: (windows,) the windows without which to fit.
    penalty: as of `cross_validate`.
    damping: of the step, see `DAMPINGS`.
    """
    others = system.sum_windows(~left_out)
    return take_step(others, known.theta, known.start_states, free, damping, penalty)


def _fit_starts(
    problem: Problem, theta: Floats, starts: Floats, power: Floats, iterations: int
) -> Floats:
    """Return the squared errors (windows, channels) with each window's start fitted from `starts`.

    power: (channels,) by which channels weigh, as in the fit to all windows.
    """

    def run(starts: Floats) -> tuple[Floats, Floats]:
        """Return squared errors and each window's cost, (windows,)."""
        with np.errstate(all="ignore"):
            squares = np.sum(compute_errors(problem, theta, starts) ** 2, axis=1)
        cost = np.sum(squares / power, axis=1) + _count_deviations(problem, starts)
        return squares, np.nan_to_num(cost, nan=np.inf)

    squares, cost = run(starts)
    for _ in range(iterations):
        system = linearise(problem, theta, starts, (), power)
        moved = take_step(system, theta, starts, (), 0.0)[1]
        new_squares, new_cost = run(moved)
        better = new_cost < cost
        starts = np.where(better[:, None], moved, starts)
        squares = np.where(better[:, None], new_squares, squares)
        cost = np.where(better, new_cost, cost)
    return squares


def _count_deviations(problem: Problem, starts: Floats) -> Floats:
    """Return the squared distances of start states from their smoothed values, (windows,).

    In deviations.
    """
    varied = list_varied(problem)
    off = (starts - problem.windows.start_states)[:, varied] / problem.deviations[varied]
    return np.asarray(np.sum(off**2, axis=1))


def compute_left_out_misfit(
    system: System | None, squares: Floats, counts: Floats, noise: Floats
) -> float:
    """Return the misfit of windows that were left out, `find_tame` windows alone.

    system: of the fit; None where no parameter is free.
    squares, counts: (windows, channels) sum of squared errors (m^2, rad^2), and samples.
    noise: (channels,) m or rad.
    """
    tame = np.ones(len(squares), dtype=bool) if system is None else find_tame(system)
    return compute_misfit(squares[tame], counts[tame], noise)


def find_tame(system: System) -> Mask:
    """Return the windows that magnify errors of their start no more than most, (windows,).

    The others lie near upright. There a parameter's last digit decides where a run falls, so that
    much would show if a twin were exact, and anything shows in a real fit.
    """
    grown = np.trace(system.start_normal, axis1=1, axis2=2)
    tame: Mask = grown <= decisions.START_ERROR_GROWTH**2 * np.median(grown)
    return tame
