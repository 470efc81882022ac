"""The encoders' steps as a recording shows them: positions lie on a grid.

All gaps between positions are whole multiples of the step.
"""

from __future__ import annotations

import numpy as np

from pendulum_sysid import decisions
from pendulum_twin.arrays import Floats

LEAST = 1e-9  # m, rad: below it gaps are rounding
WHOLE = 1000  # steps: beyond so many, rounding of the step itself adds up


def find_encoder_step(positions: Floats | None) -> float:
    """Find the step of an encoder (m or rad) in its positions (samples,); 0 where none shows."""
    if positions is None or len(positions) < decisions.ENCODER_LEAST_GAPS:
        return 0.0
    gaps = np.diff(np.sort(positions[np.isfinite(positions)]))
    gaps = np.sort(gaps[gaps > LEAST])
    if len(gaps) < decisions.ENCODER_LEAST_GAPS:
        return 0.0
    ones = gaps[gaps < 1.5 * gaps[decisions.ENCODER_ODD_GAPS]]
    if len(ones) < decisions.ENCODER_LEAST_GAPS:
        return 0.0
    step = float(np.median(ones))
    few = gaps[gaps < WHOLE * step]
    off = np.abs(few / step - np.rint(few / step))
    return step if float(np.mean(off < decisions.ENCODER_NEAR)) >= decisions.ENCODER_SHARE else 0.0
