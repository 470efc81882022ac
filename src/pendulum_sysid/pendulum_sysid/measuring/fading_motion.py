"""Whether a motion that nothing drives fades all along a recording: time looks like amplitude.

In a free decay each amplitude comes once, so a law over time follows whatever depends on the
amplitude, and fails wherever the motion begins otherwise. No such law is asked then.
"""

from __future__ import annotations

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.finding.localisation.balance import Motion
from pendulum_twin.arrays import Floats


def is_fading(motion: Motion, command: Floats, deviations: Floats) -> bool:
    """Return whether nothing drives the rig, and every joint that moves does so less and less.

    command: (n,) of the recording.
    deviations: (2,) of the measured speeds, m/s and rad/s: a joint at rest is no faster.
    """
    speeds = [
        speed
        for speed, deviation in zip((motion.v, motion.w), deviations, strict=True)
        if np.sqrt(np.mean(speed**2)) > decisions.MOVING_DEVIATIONS * deviation
    ]
    return bool(speeds) and not np.any(command) and all(map(_is_falling, speeds))


def _is_falling(speed: Floats) -> bool:
    """Return whether the power of a speed (n,) falls far, from block to block of time."""
    if len(speed) < decisions.LEAD_BLOCKS:
        return False
    powers = [np.mean(block**2) for block in np.array_split(speed, decisions.LEAD_BLOCKS)]
    if max(powers) < decisions.FADING_RATIO * min(powers):
        return False
    # Spearman's rank correlation, by hand: scipy.stats takes 0.4 s to import
    ordered = np.sort(powers)
    ranks = np.searchsorted(ordered, powers) + np.searchsorted(ordered, powers, side="right")
    correlation = np.corrcoef(np.arange(decisions.LEAD_BLOCKS), ranks)[0, 1]
    return bool(correlation <= -decisions.FADING_RANK)
