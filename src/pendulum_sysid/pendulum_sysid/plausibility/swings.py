"""Whether a pole swings so far that its own equation must show."""

from __future__ import annotations

import numpy as np

from pendulum_sysid import decisions
from pendulum_twin.signals import Signals


def swings_widely(signals: Signals, part: slice = slice(None)) -> bool:
    """Tell whether the pole swings so far that a controller and noise cannot pass for gravity.

    part: samples that are asked.
    """
    if signals.pole is None:
        return False
    angles = signals.pole[part][signals.pole_valid[part]]
    return len(angles) > 0 and float(np.ptp(angles)) >= decisions.WIDE_SWING_RAD
