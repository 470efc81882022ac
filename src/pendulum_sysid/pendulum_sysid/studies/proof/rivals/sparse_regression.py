"""Sparse regression of the unexplained acceleration on a library of the catalogue's terms, with PySINDy.

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

from pendulum_sysid.records import Ints, Windows
from pendulum_sysid.studies.proof.rivals.ground import Ground
from pendulum_sysid.studies.proof.rivals.library import Equation, build_equations
from pendulum_twin.effects import BY_NAME
from pendulum_twin.errors import BadInputError
from pendulum_twin.signals import Floats, Mask

PACKAGE = "pysindy"
THRESHOLDS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5)  # of the target's root mean square
RIDGE = 1e-3
LEAST_SAMPLES = 100


def check_installed() -> None:
    """Raise BadInputError when PySINDy is not installed."""
    if importlib.util.find_spec(PACKAGE) is None:
        raise BadInputError(
            "expected the package pysindy for the rival of sparse regression, found it missing: install it, or leave out "
            "--rivals"
        )


def name_effects(ground: Ground) -> tuple[str, ...]:
    """Return the effects that keep a term in the cart's equation or the pole's, but those that another one contains."""
    sindy = importlib.import_module(PACKAGE)
    named = dict.fromkeys(
        name for one in build_equations(ground) for name in _kept(sindy, one, ground)
    )
    contained = {simple for name in named for simple in BY_NAME[name].simpler}
    return (*ground.signs, *(name for name in named if name not in contained))


def _kept(sindy: Any, equation: Equation, ground: Ground) -> list[str]:
    making, choosing = (
        _samples(equation, windows) for windows in (ground.split.train, ground.split.choose)
    )
    if min(making.sum(), choosing.sum()) < LEAST_SAMPLES:
        return []
    making_at, choosing_at = (
        list_samples(w)[s]
        for w, s in ((ground.split.train, making), (ground.split.choose, choosing))
    )
    sizes = np.sqrt(np.mean(equation.columns[making_at] ** 2, axis=0))
    scale = max(float(np.sqrt(np.mean(equation.target[making_at] ** 2))), 1e-300)
    there = sizes > 1e-9 * max(float(sizes.max()), 1e-300)
    columns, target = equation.columns[:, there] / sizes[there], equation.target / scale
    fits = [
        _regressed(sindy, columns[making_at], target[making_at], threshold)
        for threshold in THRESHOLDS
    ]
    squares = [(target[choosing_at] - columns[choosing_at] @ one) ** 2 for one in fits]
    best = fits[choose_sparsest([_by_window(one, choosing) for one in squares])]
    names = [name for name, kept in zip(equation.effects, there, strict=True) if kept]
    return [name for name, weight in zip(names, best, strict=True) if weight and name]


def choose_sparsest(errors: Sequence[Floats]) -> int:
    """Return the last of the fits, the sparsest last, that is within one standard error of the best.

    errors: of each fit, (windows,) mean squares. Breiman, Friedman, Olshen and Stone,
    Classification and Regression Trees (1984), section 3.4.3.
    """
    means = [float(np.mean(one)) for one in errors]
    best = errors[int(np.argmin(means))]
    bound = float(np.mean(best)) + float(np.std(best)) / np.sqrt(len(best))
    return max(k for k, mean in enumerate(means) if mean <= bound)


def _regressed(sindy: Any, columns: Floats, target: Floats, threshold: float) -> Floats:
    """Return the weights, (terms,), 0 for those that were thresholded away."""
    found = sindy.STLSQ(threshold=threshold, alpha=RIDGE).fit(columns, target[:, None])
    return np.asarray(found.coef_, dtype=float).reshape(-1)


def list_samples(windows: Windows) -> Ints:
    """Return the samples of windows, (windows, samples)."""
    return windows.begin[:, None] + np.arange(windows.samples)


def _samples(equation: Equation, windows: Windows) -> Mask:
    """Return which samples of the windows count, (windows, samples)."""
    return equation.usable[list_samples(windows)]


def _by_window(squares: Floats, counting: Mask) -> Floats:
    """Return the mean of squares (counting samples,) in each window that has any."""
    totals, counts = np.zeros(len(counting)), counting.sum(axis=1)
    np.add.at(totals, np.nonzero(counting)[0], squares)
    return totals[counts > 0] / counts[counts > 0]
