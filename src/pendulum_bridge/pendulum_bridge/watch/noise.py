"""How far a rig may be off its twin without a change, and what a window says beyond that.

A window's rows scatter by the sensors' noise, by their start, and by pushes that stand for what
the twin leaves open: a share of how much the joints are accelerated. Near upright a run magnifies
everything, the pushes too, so such windows count for little. With these weights the rows give each
signature a score: the log-likelihood of its size has the slope `score` and the curvature
`information` at the twin as it is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pendulum_bridge.watch.reading import Reading
from pendulum_twin.arrays import Floats, Ints

ROUNDING = 1e-13  # of the trace: keeps a matrix with all but equal columns regular
START_DEVIATION = 1.0  # m, rad and their rates: only the window says where it starts


@dataclass(frozen=True)
class Noise:
    """Hold how rows scatter.

    sensor: (2,) m, rad; standard deviation of a sample.
    slack: (2,) share of the activity of cart and pole that the twin leaves open.
    """

    sensor: Floats
    slack: Floats


@dataclass(frozen=True)
class WeighedWindow:
    """Hold a window weighed against its noise.

    off: (rows,) left after the baseline.
    sd: (rows,) standard deviation of the sensors.
    wide: (n, rows); the inverse of the rows' covariance is diag(1/sd^2) - wide' wide.
    misfit: weighed square of off.
    spread: logarithm of the covariance's determinant for a known start; a twin that sticks must
        not be likelier because no start moves it.
    """

    off: Floats
    sd: Floats
    wide: Floats
    misfit: float
    spread: float

    def weigh(self, columns: Floats) -> Floats:
        """Return columns (rows, ...) times the inverse of the covariance."""
        precision = (1 / self.sd**2).reshape(-1, *(1,) * (columns.ndim - 1))
        return np.asarray(precision * columns - self.wide.T @ (self.wide @ columns))


def weigh(reading: Reading, noise: Noise, baseline: Floats) -> WeighedWindow:
    """Return the window weighed against its noise.

    baseline: (signatures,) sizes that are usual for the rig.
    """
    sd = noise.sensor[reading.joint]
    push = (noise.slack * reading.activity)[reading.push_joint] * reading.felt_s
    columns = np.concatenate([reading.by_push * push, START_DEVIATION * reading.by_start], axis=1)
    scaled = columns / sd[:, None]
    matrix = scaled.T @ scaled
    matrix[np.diag_indices_from(matrix)] += 1 + ROUNDING * np.trace(matrix)
    lower = np.linalg.cholesky(matrix)
    wide = np.linalg.solve(lower, scaled.T) / sd
    off = reading.off - reading.by_signature @ baseline
    misfit = float(np.sum((off / sd) ** 2) - np.sum((wide @ off) ** 2))
    pushes = len(push)  # the factor's first rows are the factor without the start
    spread = 2 * float(np.sum(np.log(np.diag(lower)[:pushes])) + np.sum(np.log(sd)))
    return WeighedWindow(off, sd, wide, misfit, spread)


def compute_scores(reading: Reading, window: WeighedWindow) -> tuple[Floats, Floats]:
    """Return score (signatures,) and information (signatures, signatures) of a window."""
    through = window.weigh(reading.by_signature)
    return through.T @ window.off, reading.by_signature.T @ through


def compute_step_scores(
    reading: Reading, window: WeighedWindow, joint: int, samples: int
) -> tuple[Floats, Floats]:
    """Return score and information of a step in a joint's readings, (samples + 1,) each.

    Entry j is for a step of 1 m or rad that shows from sample j on.
    """
    is_joint = (reading.joint == joint).astype(float)
    score = _sum_from_each(reading.at, is_joint * window.weigh(window.off), samples)
    wide = np.stack([_sum_from_each(reading.at, is_joint * row, samples) for row in window.wide])
    precision = _sum_from_each(reading.at, is_joint / window.sd**2, samples)
    return score, precision - np.sum(wide**2, axis=0)


def _sum_from_each(at: Ints, values: Floats, samples: int) -> Floats:
    """Return the sums of the rows' values from each sample of the window on, (samples + 1,)."""
    return np.cumsum(np.bincount(at, values, samples + 1)[::-1])[::-1]
