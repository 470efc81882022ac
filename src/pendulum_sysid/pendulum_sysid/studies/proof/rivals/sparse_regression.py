"""Sparse regression of the unexplained acceleration on the catalogue's terms, with PySINDy.

Brunton, Proctor and Kutz, Proc. Nat. Acad. Sci. 113 (2016) 3932: sequentially thresholded least
squares. Columns have unit root mean square; of a row of thresholds the one that predicts the
choosing windows best is taken.
"""

from __future__ import annotations

import importlib
import importlib.util
from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.stats import sem

from pendulum_sysid.records import Windows
from pendulum_sysid.studies.proof.rivals.ground import Ground
from pendulum_sysid.studies.proof.rivals.library import Equation, build_equations
from pendulum_twin.arrays import Floats, Ints, Mask
from pendulum_twin.effects import BY_NAME
from pendulum_twin.errors import BadInputError

PACKAGE = "pysindy"
THRESHOLDS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5)  # of the target's root mean square
RIDGE = 1e-3
LEAST_SAMPLES = 100  # in the training and in the choosing windows
LEAST_COLUMN = 1e-9  # of the largest column, for a term to be excited at all


def check_installed() -> None:
    """Raise BadInputError when PySINDy is not installed."""
    if importlib.util.find_spec(PACKAGE) is None:
        raise BadInputError(
            "expected the package pysindy for the rival of sparse regression, found it missing: "
            "install it, or leave out --rivals"
        )


def name_effects(ground: Ground) -> tuple[str, ...]:
    """Return the effects that keep a term in an equation, without those that others contain."""
    sindy = importlib.import_module(PACKAGE)
    named = dict.fromkeys(
        name
        for equation in build_equations(ground)
        for name in _select_terms(sindy, equation, ground)
    )
    contained = {simple for name in named for simple in BY_NAME[name].simpler}
    return (*ground.signs, *(name for name in named if name not in contained))


def _select_terms(sindy: Any, equation: Equation, ground: Ground) -> list[str]:
    """Return the effects of the terms that the best of the sparse fits keeps."""
    train, choose = ground.split.train, ground.split.choose
    train_counts, choose_counts = (
        equation.usable[list_samples(windows)] for windows in (train, choose)
    )
    if min(train_counts.sum(), choose_counts.sum()) < LEAST_SAMPLES:
        return []
    train_at = list_samples(train)[train_counts]
    choose_at = list_samples(choose)[choose_counts]
    sizes = np.sqrt(np.mean(equation.columns[train_at] ** 2, axis=0))
    scale = max(float(np.sqrt(np.mean(equation.target[train_at] ** 2))), 1e-300)
    excited = sizes > LEAST_COLUMN * max(float(sizes.max()), 1e-300)
    columns, target = equation.columns[:, excited] / sizes[excited], equation.target / scale
    fits = [
        _fit_weights(sindy, columns[train_at], target[train_at], threshold)
        for threshold in THRESHOLDS
    ]
    squares = [(target[choose_at] - columns[choose_at] @ weights) ** 2 for weights in fits]
    means = [_average_by_window(values, choose_counts) for values in squares]
    best = fits[choose_sparsest(means)]
    names = [name for name, kept in zip(equation.effects, excited, strict=True) if kept]
    return [name for name, weight in zip(names, best, strict=True) if weight and name]


def choose_sparsest(errors: Sequence[Floats]) -> int:
    """Return the sparsest fit that is within one standard error of the best fit.

    Breiman, Friedman, Olshen and Stone, Classification and Regression Trees (1984), section 3.4.3.

    errors: of each fit, the sparsest last: (windows,) mean squares.
    """
    means = [float(np.mean(squares)) for squares in errors]
    best = errors[int(np.argmin(means))]
    bound = float(np.mean(best)) + float(sem(best, ddof=0))
    return max(k for k, mean in enumerate(means) if mean <= bound)


def list_samples(windows: Windows) -> Ints:
    """Return the samples of windows, (windows, samples)."""
    return windows.begin[:, None] + np.arange(windows.samples)


def _fit_weights(sindy: Any, columns: Floats, target: Floats, threshold: float) -> Floats:
    """Return the weights (terms,); 0 for weights that the threshold took away."""
    fit = sindy.STLSQ(threshold=threshold, alpha=RIDGE).fit(columns, target[:, None])
    return np.asarray(fit.coef_, dtype=float).reshape(-1)


def _average_by_window(squares: Floats, counts: Mask) -> Floats:
    """Return the mean of squares (counting samples,) in each window that has any.

    counts: (windows, samples) which samples count.
    """
    totals = np.bincount(np.nonzero(counts)[0], squares, minlength=len(counts))
    numbers = counts.sum(axis=1)
    return totals[numbers > 0] / numbers[numbers > 0]
