"""How finely the encoders measure, from the samples alone."""

from __future__ import annotations

import numpy as np

from pendulum_bridge.watch.stream import History
from pendulum_twin.arrays import Floats

SMALLEST = np.array(
    [2e-5, 3e-4]
)  # m, rad: noise that is believed at least; pushes every 50 ms leave so much unexplained
QUANTILE = (
    0.02  # of the steps between samples: the joint's slow moments show the encoder's own step
)


class Resolution:
    """Follow the smallest usual steps between neighbouring samples of cart and pole."""

    def __init__(self) -> None:
        self._step = np.full(2, np.inf)

    def look(self, history: History) -> None:
        """Take a stretch of samples."""
        steps = np.abs(np.diff(history.positions, axis=0))
        for k in (0, 1):
            moved = steps[steps[:, k] > 1e-12, k]
            if len(moved) >= 10:
                self._step[k] = min(self._step[k], float(np.quantile(moved, QUANTILE)))

    @property
    def sensor(self) -> Floats:
        """Return the deviation of a sample of cart (m) and pole (rad), for even rounding to a step."""
        known = np.where(np.isfinite(self._step), self._step / np.sqrt(12), 0.0)
        return np.maximum(known, SMALLEST)
