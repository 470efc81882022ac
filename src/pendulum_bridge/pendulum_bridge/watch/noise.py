"""How far a rig may be off its twin without having changed, and what a window says beyond that.

A window's rows scatter by the sensors' noise, by their start, and by pushes that stand for what
the twin leaves open: a share of how much the joints are accelerated. Near upright, where a run
magnifies everything, it magnifies the pushes too, so such windows count for little. Weighted so,
the rows give each signature a score: its size's likelihood has the slope `score` and the curvature
`information` at the twin as it is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pendulum_bridge.watch.reading import Reading
from pendulum_twin.arrays import Floats, Ints

ROUNDING = (
    1e-13  # of the trace: columns that are all but the same must not end in a singular matrix
)
START_SD = 1.0  # m, rad and their rates: nothing is known of a start but what the window says


@dataclass(frozen=True)
class Noise:
    """Hold how rows scatter. sensor: (2,) m, rad. slack: (2,) of cart's and pole's activity, that the twin leaves open."""

    sensor: Floats
    slack: Floats


@dataclass(frozen=True)
class Weighed:
    """Hold a window weighed against its noise.

    off: (rows,) left after the baseline. sd: (rows,) of the sensors. wide: (n, rows); the inverse
    of the rows' covariance is diag(1/sd^2) - wide' wide. misfit: weighed square of off. spread:
    logarithm of the determinant of the covariance for a
    known start: a twin that sticks must not be likelier because no start moves it.
    """

    off: Floats
    sd: Floats
    wide: Floats
    misfit: float
    spread: float

    def times(self, columns: Floats) -> Floats:
        """Return columns (rows, ...) times the inverse of the covariance."""
        precision = (1 / self.sd**2).reshape(-1, *(1,) * (columns.ndim - 1))
        return np.asarray(precision * columns - self.wide.T @ (self.wide @ columns))


def weighed(reading: Reading, noise: Noise, baseline: Floats) -> Weighed:
    """Weigh a window; baseline: (signatures,) sizes that are usual for the rig."""
    sd = noise.sensor[reading.joint]
    push = (noise.slack * reading.activity)[reading.push_joint] * reading.felt_s
    scaled = (
        np.concatenate([reading.by_push * push, START_SD * reading.by_start], axis=1) / sd[:, None]
    )
    grown = scaled.T @ scaled
    grown[np.diag_indices_from(grown)] += 1 + ROUNDING * np.trace(grown)
    lower = np.linalg.cholesky(grown)
    wide = np.linalg.solve(lower, scaled.T) / sd
    off = reading.off - reading.by_signature @ baseline
    misfit = float(np.sum((off / sd) ** 2) - np.sum((wide @ off) ** 2))
    pushes = len(push)  # the factor's first rows are the factor without the start
    spread = 2 * float(np.sum(np.log(np.diag(lower)[:pushes])) + np.sum(np.log(sd)))
    return Weighed(off, sd, wide, misfit, spread)


def scores(reading: Reading, window: Weighed) -> tuple[Floats, Floats]:
    """Return score (signatures,) and information (signatures, signatures) of a window."""
    through = window.times(reading.by_signature)
    return through.T @ window.off, reading.by_signature.T @ through


def step_scores(
    reading: Reading, window: Weighed, joint: int, samples: int
) -> tuple[Floats, Floats]:
    """Return score and information of a step in a joint's readings before each sample of the window, (samples + 1,).

    Entry j is for a step of 1 m or rad that shows from sample j on.
    """
    mine = (reading.joint == joint).astype(float)
    score = _from_each(reading.at, mine * window.times(window.off), samples)
    seen = np.stack([_from_each(reading.at, mine * row, samples) for row in window.wide])
    return score, _from_each(reading.at, mine / window.sd**2, samples) - np.sum(seen**2, axis=0)


def _from_each(at: Ints, values: Floats, samples: int) -> Floats:
    """Return the sum of the rows' values from each sample of the window on, (samples + 1,)."""
    return np.cumsum(np.bincount(at, values, samples + 1)[::-1])[::-1]
