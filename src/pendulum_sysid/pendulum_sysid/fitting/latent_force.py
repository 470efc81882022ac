"""Measure the force that a twin lacks, as a force that wanders beside the twin.

A free run takes all that a twin lacks for noise of the sensors. Here an unknown force on the cart
and an unknown torque on the pole wander beside the twin (Ornstein-Uhlenbeck; Alvarez, Luengo and
Lawrence, AISTATS (2009)). Their sizes are those under which the errors of prediction are most
likely (prediction-error method; Ljung, System Identification (1999), section 7.2).
`docs/latent_force.md` compares what either says of sizes on concealed and on real rigs.
"""

from __future__ import annotations

from dataclasses import astuple

import numpy as np
from scipy.optimize import minimize

from pendulum_sysid import decisions
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.linearised import System
from pendulum_sysid.fitting.neighbours import list_neighbours
from pendulum_sysid.fitting.parameters import list_free_parameters
from pendulum_sysid.fitting.predictions import LatentForce, Predictions
from pendulum_sysid.records import Fit, Split
from pendulum_twin.arrays import Floats
from pendulum_twin.parameter_vector import INERTIA, MASS

FIRST_SHARE = 0.05  # of the root mean square force of the motion: where the search begins
FIRST_CORRELATION_S = 0.05
FIRST_STEP = 1.0  # of the logarithms of a force's numbers, in which the search steps
CORRELATIONS_S, NOISE_RATIOS = (0.002, 10.0), (0.1, 100.0)
RUN_S = 10.0  # of a run of the filter, far longer than the memory of its start
SAMPLES_AT_ONCE = 100_000  # bounds the memory


def measure_latent_force(case: Case, split: Split, theta: Floats) -> LatentForce:
    """Return the force beside a twin under which the errors of prediction are most likely.

    theta: (SIZE,) of the twin.
    """
    runs = _cut_runs(case)
    few = max(round(decisions.FORCE_SECONDS / RUN_S), 1)
    predictions = Predictions(case, runs[:: max(len(runs) // few, 1)], split.learn)
    steps = predictions.run_steps(theta[None])
    bounds = [*[(None, None)] * 2, np.log(CORRELATIONS_S), np.log(NOISE_RATIOS)]
    begin = np.log(astuple(_guess(case, theta)))
    simplex = begin + FIRST_STEP * np.tri(len(begin) + 1, len(begin), -1)

    def compute_cost(logs: Floats) -> float:
        return predictions.whiten(steps, LatentForce(*np.exp(logs)))[1]

    ended = minimize(
        compute_cost,
        begin,
        method="Nelder-Mead",
        bounds=bounds,
        options={"xatol": 0.1, "fatol": 0.1, "initial_simplex": simplex},
    )
    return LatentForce(*np.exp(ended.x))


def linearise_predictions(
    case: Case, split: Split, fit: Fit, latent: LatentForce, whole_steps: Floats
) -> System:
    """Return the normal equations of a fit's errors of prediction, a row for each window.

    whole_steps: (more, SIZE) further parameter vectors. Each adds a column behind those of the
        fit's parameters: the change of the errors from the fit all the way to that vector.
    """
    theta, more = fit.theta, len(whole_steps)
    free = list_free_parameters(case.twin, fit.effects, case.scales)
    parts = [Predictions(case, group, split.learn) for group in _group(_cut_runs(case))]
    sets, scale = list_neighbours(theta, free)
    sets, scale = np.concatenate([sets, whole_steps]), np.append(scale, np.ones(more))
    windows = 1 + max(int(part.window_of.max(initial=-1)) for part in parts)
    normals, scores = np.zeros((windows, len(scale), len(scale))), np.zeros((windows, len(scale)))
    for part in parts:
        steps = part.run_steps(sets)
        steps.gaps[1:] = (steps.gaps[1:] - steps.gaps[:1]) * scale[:, None, None]
        white, _ = part.whiten(steps, latent)
        columns = -np.moveaxis(white[1:], 0, -1)
        counted = part.window_of >= 0
        at = part.window_of[counted]
        np.add.at(normals, at, (columns.transpose(0, 2, 1) @ columns)[counted])
        np.add.at(scores, at, np.einsum("pcf,pc->pf", columns, white[0])[counted])
    return System(
        normals=normals,
        scores=scores,
        start_normal=np.empty((0, 0, 0)),
        start_gradient=np.empty((0, 0)),
        cross=np.empty((0, 0, len(scale))),
        start_sizes=np.empty(0),
        varied=[],
        beliefs=np.array([*(p.belief for p in free), *[0.0] * more]),
        pulls=np.array([*(p.compute_pull(theta) for p in free), *[0.0] * more]),
    )


def _cut_runs(case: Case) -> list[range]:
    """Return the recording in runs of at most RUN_S, none across a seam."""
    length = max(round(RUN_S / case.signals.period_s), 2)
    return [
        range(begin, min(begin + length, stretch.stop))
        for stretch in case.signals.stretches
        for begin in range(stretch.start, stretch.stop - 1, length)
    ]


def _group(runs: list[range]) -> list[list[range]]:
    """Return the runs in groups whose steps fit into memory together."""
    size = max(SAMPLES_AT_ONCE // max(len(run) for run in runs), 1)
    return [runs[k : k + size] for k in range(0, len(runs), size)]


def _guess(case: Case, theta: Floats) -> LatentForce:
    """Return a force that is a small share of the forces of the motion."""
    cart, pole = np.sqrt(np.mean(case.state.accelerations**2, axis=0))
    force, torque = theta[MASS] * max(cart, 1e-3), theta[INERTIA] * max(pole, 1e-3)
    first_n, first_n_m = FIRST_SHARE * float(force), FIRST_SHARE * float(torque)
    return LatentForce(first_n, first_n_m, FIRST_CORRELATION_S, 1.0)
