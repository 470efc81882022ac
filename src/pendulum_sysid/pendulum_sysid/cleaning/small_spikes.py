"""Find spikes of a few samples that are small beside the motion, where the motion around them is smooth.

A cubic through the samples on both sides says where those between should be. At a kink (an end
stop, a break from rest) the cubic fits its own samples badly too; at a spike only the samples
between are off. A corner or a step in place of a spike reaches at most 6.3 times the misfit,
whatever its phase.
"""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.ndimage import median_filter

from pendulum_sysid.cleaning.jumps import DEVIATIONS, least_of
from pendulum_twin.arrays import Floats

SIDE = 5  # samples on either side of the spike that the cubic is fitted to
WIDTHS = (1, 2, 3)  # samples of a spike
TIMES = 8.0  # the misfit, from which samples are off the curve
EVEN = 0.1  # of a period, by which the whole stretch around a spike may be off the clock


def off_curve(stamps: Floats, values: Floats, period_s: float) -> tuple[tuple[int, int], ...]:
    """Return spikes as (first, stop) samples of a signal (n,), all finite, on a nearly even clock."""
    least = least_of(values)
    taken = np.zeros(len(values), dtype=bool)
    found = []
    for width in WIDTHS:
        if len(values) < width + 2 * SIDE:
            break
        ratio = _off(stamps, values, period_s, width, least)
        for start in np.argsort(-ratio)[: np.count_nonzero(ratio > 1.0)]:
            first, stop = int(start) + SIDE, int(start) + SIDE + width
            if not taken[first - SIDE : stop + SIDE].any():
                taken[first:stop] = True
                found.append((first, stop))
    return tuple(sorted(found))


def _off(stamps: Floats, values: Floats, period_s: float, width: int, least: float) -> Floats:
    """Return how far the samples in the middle of every window are off the curve, 1 being allowed."""
    length = width + 2 * SIDE
    place = np.arange(length) - (length - 1) / 2
    middle = slice(SIDE, SIDE + width)
    outside = np.delete(np.arange(length), middle)
    powers = np.vander(place / SIDE, 4)
    onto = powers @ np.linalg.pinv(
        powers[outside]
    )  # (length, 2 SIDE): curve from the samples outside
    windows = sliding_window_view(values, length)
    off = np.abs(windows - windows[:, outside] @ onto.T)
    inside = off[:, middle].max(axis=1)
    misfit = off[:, outside].max(axis=1)
    usual = median_filter(misfit, 2 * length)
    floor = max(least, DEVIATIONS * 1.4826 * float(np.median(inside)))
    allowed = floor + TIMES * np.maximum(misfit, usual)
    even = (
        np.abs(stamps[length - 1 :] - stamps[: len(windows)] - (length - 1) * period_s)
        < EVEN * period_s
    )
    return np.where(even, inside / allowed, 0.0)
