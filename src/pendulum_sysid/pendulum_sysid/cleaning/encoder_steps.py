"""The encoders' steps, as a recording shows them: positions lie on a grid, so all gaps between them are whole multiples."""

from __future__ import annotations

import numpy as np

from pendulum_twin.arrays import Floats

LEAST = 1e-9  # m, rad: below it gaps are rounding
NEAR = 0.05  # of a step: how far from a whole number of steps a gap may be
SHARE = 0.95  # of the gaps that must be whole multiples
FEWEST = 20  # gaps of one step that a recording must hold
FEW = 5  # gaps that may be smaller, next to spikes
WHOLE = 1000  # steps: beyond so many, rounding of the step itself adds up


def encoder_step(positions: Floats | None) -> float:
    """Return the step of an encoder (m or rad) from its positions (samples,); 0.0 where none shows."""
    if positions is None or len(positions) < FEWEST:
        return 0.0
    gaps = np.diff(np.sort(positions[np.isfinite(positions)]))
    gaps = np.sort(gaps[gaps > LEAST])
    if len(gaps) < FEWEST:
        return 0.0
    ones = gaps[gaps < 1.5 * gaps[FEW]]
    if len(ones) < FEWEST:
        return 0.0
    step = float(np.median(ones))
    few = gaps[gaps < WHOLE * step]
    off = np.abs(few / step - np.rint(few / step))
    return step if float(np.mean(off < NEAR)) >= SHARE else 0.0
