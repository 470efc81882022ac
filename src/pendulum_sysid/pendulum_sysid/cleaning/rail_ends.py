"""Leave out where the cart stands at an end of the rail: the end pushes, as no law of a twin does.

A tilted rail lets the cart roll to its end before a plan begins. The end's push then looks like a
force of the position that undoes the tilt there.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import binary_dilation

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.clock import find_runs
from pendulum_sysid.cleaning.leaving_out import leave_samples_out
from pendulum_sysid.records import QualityFinding, Recording
from pendulum_twin.arrays import Floats, Mask

NOTE = "the cart stands at an end of the rail, which pushes; left out"


def leave_out_rail_ends(recording: Recording, half_m: float | None) -> Recording:
    """Mark the samples at the rail's ends as not valid, begin stretches there, add the finding.

    half_m: half of the rail's length; None where nobody knows.

    Returns the same recording when the cart stands at no end.
    """
    signals = recording.signals
    if signals.cart is None or half_m is None:
        return recording
    at_end = find_rail_ends(signals.cart, signals.cart_valid, half_m)
    if not at_end.any() or is_locked(signals.cart[signals.cart_valid]):
        return recording
    margin = max(round(decisions.SLIP_MARGIN_S / signals.period_s), 1)
    runs, times = find_runs(binary_dilation(at_end, iterations=margin)), signals.times_s
    spans = tuple((float(times[a]), float(times[b - 1]) + signals.period_s) for a, b in runs)
    return leave_samples_out(recording, runs, QualityFinding("rail_end", len(runs), spans, NOTE))


def is_locked(cart: Floats) -> bool:
    """Return whether a cart, m, (n,), never leaves its place: the pole alone is asked then."""
    return float(np.ptp(cart)) <= 2.0 * decisions.RAIL_END_M


def find_rail_ends(cart: Floats, valid: Mask, half_m: float) -> Mask:
    """Return at which samples (n,) the cart is at an end of the rail.

    cart: (n,) m; valid: (n,) where the reading counts.

    An end is where the cart goes no farther. A reading beyond it says that the rail's length, or
    the reading's zero, is not what the twin says, so nothing is known of that end.
    """
    at_end = np.zeros(len(cart), dtype=bool)
    for way in (1.0, -1.0):
        beyond = way * cart - half_m
        if np.max(beyond, where=valid, initial=-np.inf) <= decisions.RAIL_END_M:
            at_end |= valid & (beyond >= -decisions.RAIL_END_M)
    return at_end
