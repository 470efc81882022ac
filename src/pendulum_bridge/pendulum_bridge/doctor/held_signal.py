"""A held command after a lag, averaged as second differences average it."""

from __future__ import annotations

import numpy as np

from pendulum_twin.arrays import Floats

STEPS_PER_PERIOD = 8  # of the fine grid, a sample period


class HeldSignal:
    """Hold the triangular means of a held signal.

    at: (m,) s, when each value begins; before the first value the signal is 0.
    values: (m,).
    lag_s: time constant of a first-order lag that the signal passes.
    span_s: half the base of the triangle.
    period_s: sample period.
    """

    def __init__(
        self, at: Floats, values: Floats, lag_s: float, span_s: float, period_s: float
    ) -> None:
        step_s = period_s / STEPS_PER_PERIOD
        self._times = np.arange(at[0] - 2 * span_s, at[-1] + 2 * span_s, step_s)
        began = np.searchsorted(at, self._times, "right") - 1
        fine = np.where(began >= 0, values[np.maximum(began, 0)], 0.0)
        half = max(round(span_s / step_s), 1)
        triangle = np.concatenate([np.arange(1, half + 1), np.arange(half - 1, 0, -1)]) / half**2
        self._means = np.convolve(_apply_lag(fine, lag_s, step_s), triangle, "same")

    def average_around(self, times: Floats) -> Floats:
        """Return the means around the times (n,) s."""
        return np.interp(times, self._times, self._means)


def _apply_lag(values: Floats, lag_s: float, step_s: float) -> Floats:
    if lag_s <= 0:
        return values
    keep, output = float(np.exp(-step_s / lag_s)), 0.0
    passed = np.empty_like(values)
    for k, value in enumerate(values.tolist()):
        output = value + keep * (output - value)
        passed[k] = output
    return passed
