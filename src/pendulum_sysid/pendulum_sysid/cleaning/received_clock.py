"""Where the even clock of the samples lies: no sample is received before it is taken.

A driver estimates sampling times from arrivals, and on a busy computer most arrivals are late. An
even clock through such stamps lies late, and drifts. The samples that are received soonest tell
more: a straight line below all delays, as near to them as it can be, says how far and how fast the
clock is off (Moon, Skelly and Towsley, Estimation and removal of clock skew from network delay
measurements, 1999). A sender that stood still goes on by a clock that begins anew, so the line
jumps over gaps.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import coo_array

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.even_clock import EvenClock
from pendulum_sysid.cleaning.paused_clock import BLOCK
from pendulum_twin.arrays import Floats, Ints, Mask


def place_clock(clock: EvenClock, received_s: Floats) -> tuple[EvenClock, Mask] | None:
    """Return the clock on which the samples that were received soonest were received at once.

    Returns which samples (n,) are sure on it, too: too few between two gaps tell no clock.

    None where even the soonest sample takes long from the clock to the receiver: then the stamps
    hold a delay that is known to the driver, or are of another clock. None without sure samples.

    received_s: (n,) when each sample was received, s.
    """
    pieces = _number_pieces(clock)
    sure = np.bincount(pieces)[pieces] >= BLOCK
    line = _fit_below(received_s - clock.times_s, pieces)
    if line is None or not sure.any() or np.mean(line[sure]) > decisions.SOONEST_S:
        return None
    if np.max(np.abs(line[sure])) > decisions.LONGEST_LATENCY_S:
        return None
    placed = replace(clock, off_s=clock.off_s - line, shifts_s=clock.shifts_s + line)
    return placed, sure


def _number_pieces(clock: EvenClock) -> Ints:
    """Return the number of each sample's piece (n,), from 0; gaps and pauses begin a piece."""
    steps_s = np.diff(clock.times_s)
    longest_s = (decisions.LONGEST_FILL + 1.5) * clock.period_s
    paused = np.diff(np.broadcast_to(clock.shifts_s, clock.off_s.shape)) != 0.0
    return np.concatenate([[0], np.cumsum((steps_s > longest_s) | paused)])


def _fit_below(values: Floats, pieces: Ints) -> Floats | None:
    """Return the straight line (n,) below all values (n,) that is nearest to them; None if none.

    Nearest by the mean distance: a linear program. The line may jump from piece to piece.

    pieces: (n,) number of each value's piece, from 0.
    """
    count = len(values)
    at = np.linspace(-0.5, 0.5, count)
    rows, last = np.tile(np.arange(count), 2), pieces[-1] + 1
    entries = np.concatenate([np.ones(count), at])
    columns = coo_array((entries, (rows, np.concatenate([pieces, np.full(count, last)]))))
    mean = np.asarray(columns.sum(axis=0)) / count
    best = linprog(-mean, columns.tocsc(), values, bounds=(None, None), method="highs")
    line: Floats | None = columns @ best.x if best.status == 0 else None
    return line
