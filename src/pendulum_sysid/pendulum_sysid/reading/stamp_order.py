"""Samples that came out of the order of their stamps: left out, unless the clock was set back.

Messages overtake each other on their way, and a stamp may be wrong. The place of such a sample is
empty among the others, by its stamp or where it stands. Where a clock was set back no place is
empty, and nothing tells how much time is lost: such a recording is left as it is, and refused.
"""

from __future__ import annotations

from bisect import bisect_right

import numpy as np

from pendulum_sysid import decisions
from pendulum_twin.arrays import Ints, Mask

NEIGHBOURS = 20  # samples on either side, over which the time is compared with their number
LEAST_LOST_PERIODS = 0.5  # of time; a clock that runs backwards was set back by a period at least
LEAST_APART_PERIODS = 0.75  # a stamp in a full row is within 0.5 of a neighbour


def find_ordered(stamps_ns: Ints) -> Mask:
    """Return which samples to use, (n,): the most whose stamps, (n,), ns, do not fall.

    All are used where the clock was set back, and where more are out of order than may be missing.
    """
    every = np.ones(len(stamps_ns), dtype=bool)
    if not np.any(np.diff(stamps_ns) < 0):
        return every
    ordered = _find_longest_rise(stamps_ns)
    few = np.count_nonzero(~ordered) <= decisions.MOST_NOT_FINITE * len(stamps_ns)
    return every if not few or _is_time_lost(stamps_ns, ordered) else ordered


def _find_longest_rise(stamps_ns: Ints) -> Mask:
    """Return the longest subsequence that does not fall, by patience sorting."""
    tails: list[int] = []  # the least stamp at which a subsequence of each length ends
    places: list[int] = []
    before = np.full(len(stamps_ns), -1)
    for k, stamp in enumerate(stamps_ns.tolist()):
        length = bisect_right(tails, stamp)
        before[k] = places[length - 1] if length else -1
        tails[length : length + 1], places[length : length + 1] = [stamp], [k]
    chosen = np.zeros(len(stamps_ns), dtype=bool)
    at = places[-1]
    while at >= 0:
        chosen[at] = True
        at = int(before[at])
    return chosen


def _is_time_lost(stamps_ns: Ints, ordered: Mask) -> bool:
    """Return whether samples out of order have no place among the others: their time is lost.

    A sample that was overtaken fits between the others by its stamp, and a sample with a wrong
    stamp where it stands.
    """
    kept, left_out = np.flatnonzero(ordered), np.flatnonzero(~ordered)
    others = stamps_ns[kept]
    steps = np.diff(others)
    if not np.any(steps):
        return True
    period_ns = float(np.median(steps[steps > 0]))  # samples may have come twice
    after = np.searchsorted(others, stamps_ns[left_out])
    sides = others[np.clip([after - 1, after], 0, len(others) - 1)]
    nearest = np.abs(sides - stamps_ns[left_out]).min(axis=0) / period_ns
    crowded = left_out[nearest < LEAST_APART_PERIODS]
    reach = np.arange(1, NEIGHBOURS + 1)
    for gap in np.unique(np.searchsorted(kept, crowded)):
        a = kept[np.maximum(gap - reach, 0)]
        b = kept[np.minimum(gap - 1 + reach, len(kept) - 1)]
        lost = (b - a) - (stamps_ns[b] - stamps_ns[a]) / period_ns
        if np.median(lost) > LEAST_LOST_PERIODS:  # a neighbour may be out of its place, too
            return True
    return False
