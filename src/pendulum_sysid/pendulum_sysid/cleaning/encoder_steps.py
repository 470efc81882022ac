"""The encoders' steps as a recording shows them: positions lie on a grid.

All gaps between positions are whole multiples of the step. The step of a pole's encoder tells how
many counts it has a turn, and a rig mostly has equal encoders on both axes.
"""

from __future__ import annotations

import numpy as np

from pendulum_sysid import decisions
from pendulum_twin.arrays import Floats
from pendulum_twin.signals import Signals

LEAST = 1e-9  # m, rad: below it gaps are rounding
UNEVEN_COUNTS = 0.01  # counts a turn, by which a turn may be off a whole number: steps are rounded
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


def find_shaft_turn(signals: Signals) -> float:
    """Return how far the cart goes (m) in a turn of the shaft that its encoder is on; 0: unknown.

    The cart's encoder is taken to have as many counts a turn as the pole's encoder.
    """
    step_m, step_rad = find_encoder_step(signals.cart), find_encoder_step(signals.pole)
    if not (step_m and step_rad):
        return 0.0
    counts = 2.0 * np.pi / step_rad
    is_whole = abs(counts - np.rint(counts)) < UNEVEN_COUNTS
    return float(np.rint(counts) * step_m) if is_whole else 0.0
