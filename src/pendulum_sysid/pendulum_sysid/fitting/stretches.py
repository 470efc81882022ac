"""Stretches of time that adjacent windows cover together."""

from __future__ import annotations

import numpy as np

from pendulum_twin.arrays import Floats

SLACK_S = 1e-9  # of a seam: the times of two windows that touch round apart


def join_stretches(begins_s: Floats, seconds: float) -> tuple[tuple[float, float], ...]:
    """Return (begin, end) of the stretches, s, that windows of one length cover, in their order.

    begins_s: (windows,) in any order. seconds: length of a window.
    """
    stretches: list[tuple[float, float]] = []
    for begin_s in np.sort(begins_s).tolist():
        first_s = begin_s
        if stretches and begin_s <= stretches[-1][1] + SLACK_S:
            first_s, _ = stretches.pop()
        stretches.append((first_s, begin_s + seconds))
    return tuple(stretches)
