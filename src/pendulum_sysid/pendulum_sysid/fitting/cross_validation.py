"""Cross-validate a fit: each window is judged by parameters that were fitted to other windows.

The fit to the other windows is a Gauss-Newton step from the fit to all of them, as for the
leave-out formulas of linear regression (Hastie, Tibshirani and Friedman, The Elements of
Statistical Learning (2009), section 7.10). A window's own start state follows its parameters.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.fitting.gauss_newton import Solution, take_step
from pendulum_sysid.fitting.linearised import FAR, Problem, System, compute_errors_by_set
from pendulum_sysid.fitting.parameters import Free
from pendulum_twin.arrays import Floats

DAMPING = 1e-3  # of a parameter's own weight: bounds the step along what the others leave open


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
    sets, starts = np.empty((decisions.FOLDS, solution.theta.size)), solution.start_states.copy()
    sets[:] = solution.theta
    for k in folds:
        others = penalise(
            replace(system, normals=system.normals[fold != k], scores=system.scores[fold != k]),
            solution.theta,
            free,
            penalty,
        )
        sets[k], moved = take_step(others, solution.theta, solution.start_states, free, DAMPING)
        starts[fold == k] = moved[fold == k]
    with np.errstate(all="ignore"):
        errors = compute_errors_by_set(problem, sets, fold, starts)
        squares = np.sum(errors**2, axis=1)
    far = FAR**2 * problem.windows.samples * solution.power
    return np.minimum(np.nan_to_num(squares, nan=np.inf), far)


def penalise(
    system: System, theta: Floats, free: tuple[Free, ...], penalty: Floats | None
) -> System:
    """Return normal equations with the pull of a penalty towards 0 added to them.

    penalty: (parameters, parameters) in the parameters' sizes; None for none.
    """
    if penalty is None:
        return system
    scaled = np.array([parameter.get(theta) / parameter.size for parameter in free])
    return replace(
        system,
        normals=np.concatenate([system.normals, penalty[None]]),
        scores=np.concatenate([system.scores, -(penalty @ scaled)[None]]),
    )
