"""Find spikes of a few samples that are small beside the motion around them, where it is smooth.

A cubic through the samples on both sides says where those between should be. At a kink (an end
stop, a break from rest) the cubic fits its own samples badly too; at a spike only the samples
between are off. A corner or a step in place of a spike reaches at most 6.3 times the misfit,
whatever its phase.
"""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.ndimage import median_filter

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.jumps import measure_least_step
from pendulum_twin.arrays import Floats

WIDTHS = (1, 2, 3)  # samples of a spike


def find_small_spikes(
    stamps: Floats, values: Floats, period_s: float
) -> tuple[tuple[int, int], ...]:
    """Find spikes, (first, stop) samples of a signal (n,), all finite, on a nearly even clock."""
    least = measure_least_step(values)
    taken = np.zeros(len(values), dtype=bool)
    spikes = []
    for width in WIDTHS:
        if len(values) < width + 2 * decisions.SMALL_SPIKE_SIDE:
            break
        ratio = _compare_with_curve(stamps, values, period_s, width, least)
        for start in np.argsort(-ratio)[: np.count_nonzero(ratio > 1.0)]:
            first, stop = (
                int(start) + decisions.SMALL_SPIKE_SIDE,
                int(start) + decisions.SMALL_SPIKE_SIDE + width,
            )
            if not taken[
                first - decisions.SMALL_SPIKE_SIDE : stop + decisions.SMALL_SPIKE_SIDE
            ].any():
                taken[first:stop] = True
                spikes.append((first, stop))
    return tuple(sorted(spikes))


def _compare_with_curve(
    stamps: Floats, values: Floats, period_s: float, width: int, least: float
) -> Floats:
    """Return how far the middle of every window is off the curve; 1 is allowed."""
    length = width + 2 * decisions.SMALL_SPIKE_SIDE
    place = np.arange(length) - (length - 1) / 2
    middle = slice(decisions.SMALL_SPIKE_SIDE, decisions.SMALL_SPIKE_SIDE + width)
    outside = np.delete(np.arange(length), middle)
    powers = np.vander(place / decisions.SMALL_SPIKE_SIDE, 4)
    onto = powers @ np.linalg.pinv(
        powers[outside]
    )  # (length, 2 SIDE): curve from the samples outside
    windows = sliding_window_view(values, length)
    off = np.abs(windows - windows[:, outside] @ onto.T)
    inside = off[:, middle].max(axis=1)
    misfit = off[:, outside].max(axis=1)
    usual = median_filter(misfit, 2 * length)
    floor = max(least, decisions.SPIKE_DEVIATIONS * 1.4826 * float(np.median(inside)))
    allowed = floor + decisions.SMALL_SPIKE_RATIO * np.maximum(misfit, usual)
    even = (
        np.abs(stamps[length - 1 :] - stamps[: len(windows)] - (length - 1) * period_s)
        < decisions.SMALL_SPIKE_CLOCK * period_s
    )
    return np.where(even, inside / allowed, 0.0)
