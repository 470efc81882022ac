"""Sparse regression of the accelerations of cart and pole on a library, with PySINDy.

Brunton, Proctor and Kutz, Proc. Nat. Acad. Sci. 113 (2016) 3932; with control: Kaiser, Kutz and
Brunton, Proc. Royal Society A 474 (2018) 20180335. Columns go through the smoothing of the
accelerations and have unit root mean square. Threshold and ridge are those with which free runs on
the choosing windows are best.
"""

from __future__ import annotations

import importlib
import itertools
import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np

from pendulum_sysid.records import Windows
from pendulum_sysid.studies.proof.rival_models.dynamics_library import Library
from pendulum_sysid.studies.proof.rival_models.integrate import integrate
from pendulum_sysid.studies.proof.rival_models.missing_force import average_command
from pendulum_sysid.studies.proof.rival_models.model import check_both_joints, measure_score
from pendulum_sysid.studies.proof.rival_models.refitted_constants import refit_constants
from pendulum_sysid.studies.proof.rivals.ground import Ground
from pendulum_sysid.studies.proof.rivals.library import find_half_length, smooth_like_positions
from pendulum_sysid.studies.proof.rivals.sparse_regression import PACKAGE, list_samples
from pendulum_twin.arrays import Floats, Ints, Mask
from pendulum_twin.parameter_vector import COUPLING, INERTIA, MASS
from pendulum_twin.signals import Signals

THRESHOLDS = (0.0, 0.001, 0.003, 0.01, 0.03, 0.1)  # of the acceleration's root mean square
RIDGES = (1e-6, 1e-4, 1e-2)
LEAST_COLUMN = 1e-9  # root mean square, of a column to be divided by


@dataclass(frozen=True)
class SparseDynamics:
    """Accelerations that are sums of library terms.

    library: computes the terms.
    weights: of the terms of v' and of w'; 0 for terms that are left out.
    """

    library: Library
    weights: tuple[Floats, Floats]

    def run(self, signals: Signals, windows: Windows) -> Floats:
        """Return free runs; see `Model`."""
        return integrate(self.compute_accelerations, signals, windows)

    def compute_accelerations(self, states: Floats, command: Floats) -> Floats:
        """Return v' (m/s^2) and w' (rad/s^2), (k, 2)."""
        columns = self.library.evaluate(states, command)
        return np.stack([a @ b for a, b in zip(columns, self.weights, strict=True)], axis=1)


@dataclass(frozen=True)
class Regression:
    """The regressions of both accelerations along a recording.

    columns: (n, terms) for v' and for w', smoothed as accelerations are.
    targets: (n, 2) smoothed accelerations, m/s^2 and rad/s^2.
    usable: (n,) which samples count.
    """

    columns: tuple[Floats, Floats]
    targets: Floats
    usable: Mask

    def pick_samples(self, windows: Windows) -> Ints:
        """Return the samples of windows that count."""
        at = np.unique(list_samples(windows))
        return at[self.usable[at]]


def fit_model(ground: Ground) -> SparseDynamics:
    """Return the sparse dynamics that run the choosing windows best, fitted to all of them."""
    check_both_joints(ground)
    sindy = importlib.import_module(PACKAGE)
    library = make_library(ground)
    regression = make_regression(ground, library)
    train = regression.pick_samples(ground.split.train)

    def measure(options: tuple[float, float]) -> float:
        model = SparseDynamics(library, fit_weights(sindy, regression, train, *options))
        return measure_score(model, ground.case, ground.split.choose)

    best = min(itertools.product(THRESHOLDS, RIDGES), key=measure)
    learn = regression.pick_samples(ground.split.learn)
    return SparseDynamics(library, fit_weights(sindy, regression, learn, *best))


def make_library(ground: Ground) -> Library:
    """Return the library with the coupling of the refitted twin."""
    theta = refit_constants(ground).theta
    share = theta[COUPLING] ** 2 / (theta[MASS] * theta[INERTIA])
    v, w = np.sqrt(np.mean(ground.case.state.states[:, 2:] ** 2, axis=0))
    return Library(float(share), (float(v) or 1.0, float(w) or 1.0))


def make_regression(ground: Ground, library: Library) -> Regression:
    """Return the regressions along the smoothed motion of the recording."""
    signals, state = ground.case.signals, ground.case.state
    half = find_half_length(signals)
    v_columns, w_columns = (
        np.stack([smooth_like_positions(column, signals, half) for column in columns.T], axis=1)
        for columns in library.evaluate(state.states, average_command(signals))
    )
    usable = signals.cart_valid & signals.pole_valid
    return Regression((v_columns, w_columns), state.accelerations, usable)


def fit_weights(
    sindy: Any, regression: Regression, at: Ints, threshold: float, ridge: float
) -> tuple[Floats, Floats]:
    """Return the weights of the terms of v' and of w', fitted to samples `at`.

    threshold: below which a weight is 0, of the acceleration's root mean square.
    ridge: penalty on the weights of columns with unit root mean square.
    """
    v_weights, w_weights = (
        _fit_equation(sindy, columns[at], regression.targets[at, k], threshold, ridge)
        for k, columns in enumerate(regression.columns)
    )
    return v_weights, w_weights


def _fit_equation(
    sindy: Any, columns: Floats, target: Floats, threshold: float, ridge: float
) -> Floats:
    sizes = np.sqrt(np.mean(columns**2, axis=0))
    excited = sizes > LEAST_COLUMN
    scale = max(float(np.sqrt(np.mean(target**2))), 1e-300)
    weights = np.zeros(len(sizes))
    optimizer = sindy.STLSQ(threshold=threshold, alpha=ridge * len(target))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of a threshold that takes every term
        fitted = optimizer.fit(columns[:, excited] / sizes[excited], target[:, None] / scale)
    weights[excited] = np.asarray(fitted.coef_).reshape(-1) * scale / sizes[excited]
    return weights
