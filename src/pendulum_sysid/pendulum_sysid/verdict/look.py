"""What all pictures share: their colours, and which values they can show."""

from __future__ import annotations

import numpy as np

from pendulum_twin.arrays import Floats

INK, SOFT, PALE, ACCENT = "#16191d", "#59636e", "#b4bcc5", "#0b5cad"
MOST_DRAWABLE = 1e30  # a run beyond it has diverged
MOST_ON_LOG_SCALE = 1e12  # a larger error would leave the others no room


def keep_drawable(values: Floats) -> Floats:
    """Return values with NaN where a run has diverged beyond what can be drawn."""
    return np.where(np.abs(values) < MOST_DRAWABLE, values, np.nan)


def keep_drawable_on_log_scale(values: Floats) -> Floats:
    """Return values with NaN where they are not above 0, or have diverged beyond what shows."""
    return np.where((values > 0) & (values < MOST_ON_LOG_SCALE), values, np.nan)
