"""Where the even clock of the samples lies: no sample is received before it is taken.

A driver estimates sampling times from arrivals, and on a busy computer most arrivals are late. An
even clock through such stamps lies late, and drifts. The samples that are received soonest tell
more: a straight line below all delays, as near to them as it can be, says how far and how fast the
clock is off (Moon, Skelly and Towsley, Estimation and removal of clock skew from network delay
measurements, 1999).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.optimize import linprog

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.even_clock import EvenClock
from pendulum_twin.arrays import Floats


def place_clock(clock: EvenClock, received_s: Floats) -> EvenClock | None:
    """Return the clock on which the samples that were received soonest were received at once.

    None where even the soonest sample takes long from the clock to the receiver: then the stamps
    hold a delay that is known to the driver, or are of another clock.

    received_s: (n,) when each sample was received, s.
    """
    late_s = received_s - clock.times_s
    line = _fit_below(late_s)
    if line is None or np.mean(line) > decisions.SOONEST_S:
        return None
    if np.ptp(line) > decisions.LONGEST_LATENCY_S or -np.mean(line) > decisions.LONGEST_LATENCY_S:
        return None
    return replace(clock, off_s=clock.off_s - line, shifts_s=clock.shifts_s + line)


def _fit_below(values: Floats) -> Floats | None:
    """Return the straight line (n,) below all values (n,) that is nearest to them; None if none.

    Nearest by the mean distance: a linear program of two unknowns.
    """
    at = np.linspace(-0.5, 0.5, len(values))
    columns = np.column_stack([np.ones(len(values)), at])
    best = linprog(-columns.mean(axis=0), columns, values, bounds=(None, None), method="highs")
    return columns @ best.x if best.status == 0 else None
