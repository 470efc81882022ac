"""A Gaussian process for the force and torque that the refitted twin lacks.

Rasmussen and Williams, Gaussian Processes for Machine Learning (2006), chapters 2 and 5: a kernel
with a length for each input, its sizes by the marginal likelihood, on samples drawn from the
recording. The twin runs with the process's mean. Whether force, torque or both help is chosen on
windows that the process has not seen.
"""

from __future__ import annotations

import importlib
import importlib.util
import itertools
import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import minimize

from pendulum_sysid.records import Windows
from pendulum_sysid.studies.proof.rival_models.missing_force import (
    MissingForce,
    PushedTwin,
    measure_missing_force,
)
from pendulum_sysid.studies.proof.rival_models.model import check_both_joints, measure_score
from pendulum_sysid.studies.proof.rival_models.refitted_constants import refit_constants
from pendulum_sysid.studies.proof.rivals.ground import Ground
from pendulum_sysid.studies.proof.rivals.sparse_regression import list_samples
from pendulum_twin.arrays import Floats, Ints
from pendulum_twin.errors import BadInputError

PACKAGE = "sklearn"
SAMPLES = 1000  # drawn for training: the work grows with the third power
SEED = 0
LENGTHS = (0.03, 100.0)  # of an input's deviation
NOISES = (1e-6, 10.0)  # variance, of the target's
MOST_EVALUATIONS = 60  # of the marginal likelihood


def check_installed() -> None:
    """Raise BadInputError when scikit-learn is not installed."""
    if importlib.util.find_spec(PACKAGE) is None:
        raise BadInputError(
            "expected the package scikit-learn for the rival of a Gaussian process, found it "
            "missing: install it, or leave out --rivals"
        )


@dataclass(frozen=True)
class Process:
    """The mean of a fitted process.

    regressor: scikit-learn's, fitted.
    scales: (6,) by which inputs are divided.
    """

    regressor: Any
    scales: Floats

    def predict(self, states: Floats, command: Floats) -> Floats:
        """Return the mean (k,) at states (k, 4) and commands (k,)."""
        inputs = list_inputs(states, command) / self.scales
        trained, weights = self.regressor.X_train_, self.regressor.alpha_
        mean = self.regressor.kernel_(inputs, trained) @ weights
        return self.regressor._y_train_std * mean.reshape(-1) + self.regressor._y_train_mean


def fit_model(ground: Ground) -> PushedTwin:
    """Return the refitted twin with the mean of the process as a further force and torque."""
    check_both_joints(ground)
    theta = refit_constants(ground).theta
    missing = measure_missing_force(ground.case, theta)
    trained = [fit_process(missing, ground.split.train, column) for column in (0, 1)]
    choices = list(itertools.product((False, True), repeat=2))
    scores = [
        measure_score(PushedTwin(theta, Push(trained, chosen)), ground.case, ground.split.choose)
        for chosen in choices
    ]
    chosen = choices[int(np.argmin(scores))]
    full = [
        fit_process(missing, ground.split.learn, column, process) if wanted else process
        for column, (process, wanted) in enumerate(zip(trained, chosen, strict=True))
    ]
    return PushedTwin(theta, Push(full, chosen))


@dataclass(frozen=True)
class Push:
    """Force and torque by two processes, of which any may be left out.

    processes: of the force and of the torque.
    chosen: which of them act.
    """

    processes: list[Process]
    chosen: tuple[bool, ...]

    def __call__(self, states: Floats, command: Floats) -> Floats:
        """Return force (N) and torque (N m), (k, 2)."""
        columns = [
            process.predict(states, command) if acts else np.zeros(len(states))
            for process, acts in zip(self.processes, self.chosen, strict=True)
        ]
        return np.stack(columns, axis=1)


def list_inputs(states: Floats, command: Floats) -> Floats:
    """Return the inputs of a process, (k, 6): x, sin th, cos th, v, w and the command."""
    x, th, v, w = states.T
    return np.stack([x, np.sin(th), np.cos(th), v, w, command], axis=1)


def fit_process(
    missing: MissingForce, windows: Windows, column: int, known: Process | None = None
) -> Process:
    """Return the process of a force (column 0) or torque (column 1), fitted on windows.

    known: a process whose kernel is taken over; None for a kernel by the marginal likelihood.
    """
    at = draw_samples(missing, windows)
    inputs = list_inputs(missing.states[at], missing.command[at])
    scales = np.maximum(inputs.std(axis=0), 1e-9) if known is None else known.scales
    regression = importlib.import_module(f"{PACKAGE}.gaussian_process")
    kernels = importlib.import_module(f"{PACKAGE}.gaussian_process.kernels")
    kernel = (
        kernels.ConstantKernel(1.0, (1e-3, 1e3)) * kernels.RBF(np.ones(inputs.shape[1]), LENGTHS)
        + kernels.WhiteKernel(0.1, NOISES)
        if known is None
        else known.regressor.kernel_
    )
    regressor = regression.GaussianProcessRegressor(
        kernel, optimizer=_minimise if known is None else None, normalize_y=True
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a length at its bound says that an input does nothing
        regressor.fit(inputs / scales, missing.forces[at, column])
    return Process(regressor, scales)


def draw_samples(missing: MissingForce, windows: Windows) -> Ints:
    """Return usable samples of windows, drawn evenly over them, at most SAMPLES."""
    at = np.unique(list_samples(windows))
    at = at[missing.usable[at]]
    if len(at) <= SAMPLES:
        return at
    return np.sort(np.random.default_rng(SEED).choice(at, SAMPLES, replace=False))


def _minimise(objective: Any, initial: Floats, bounds: Floats) -> tuple[Floats, float]:
    """Return the sizes of a kernel with the least negative log likelihood, and that value."""
    result = minimize(
        objective,
        initial,
        jac=True,
        bounds=bounds,
        method="L-BFGS-B",
        options={"maxfun": MOST_EVALUATIONS},
    )
    return result.x, float(result.fun)
