"""Measure how finely the encoders count, from the samples alone."""

from __future__ import annotations

import numpy as np

from pendulum_bridge.watch.stream import History
from pendulum_twin.arrays import Floats

# m, rad; least deviation of a sample: pushes every 50 ms leave so much unexplained.
SMALLEST_NOISE = np.array([2e-5, 3e-4])
STEP_QUANTILE = 0.02  # of the steps between samples: slow motion shows the encoder's own step
LEAST_STEPS = 10  # of a joint that moves


class Resolution:
    """Follow the smallest usual steps between neighbouring samples of cart and pole."""

    def __init__(self) -> None:
        self._step = np.full(2, np.inf)

    def look(self, history: History) -> None:
        """Take a stretch of samples."""
        steps = np.abs(np.diff(history.positions, axis=0))
        for k in (0, 1):
            moved = steps[steps[:, k] > 1e-12, k]
            if len(moved) >= LEAST_STEPS:
                self._step[k] = min(self._step[k], float(np.quantile(moved, STEP_QUANTILE)))

    @property
    def sensor(self) -> Floats:
        """Return the standard deviation of a sample, (2,) m and rad, for rounding to a step."""
        rounding = np.where(np.isfinite(self._step), self._step / np.sqrt(12), 0.0)
        return np.maximum(rounding, SMALLEST_NOISE)
