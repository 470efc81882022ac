"""Messages that a busy computer sends late, and that pause: the earliest tell the clock.

A sender that falls behind catches up in a burst: its messages are late, and their clock goes on.
A sender that gives up the time that it lost pauses: its clock goes on from there. A message comes
late or in time, and never early. So a stamp less the periods before it is the clock's begin and
pauses, plus a delay; the least of it over this and all later messages is without the delay, and
rises only where the sender pauses.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from scipy.ndimage import minimum_filter1d

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.even_clock import REACH, EvenClock
from pendulum_twin.arrays import Floats, Mask

AHEAD = 300  # messages, of which at least the earliest is in time, while the period is measured
BLOCK = 50  # messages, whose earliest measures the period; a shorter piece tells no clock
EARLIEST = 0.05  # quantile of a piece's stamps, that lies on its clock


def find_paused_clock(stamps: Floats) -> tuple[EvenClock, Mask] | None:
    """Return the clock of stamps (n,) that never fall, and which messages (n,) are sure on it.

    A message around a pause may have been sent before or after. None where too few are sure: in a
    block whose earliest message is not in time, either, messages were lost that were not counted.
    """
    numbers = np.arange(len(stamps))
    if len(stamps) < 2 * AHEAD:
        return None
    period_s = float(np.median(stamps[REACH:] - stamps[:-REACH])) / REACH
    if not period_s > 0.0:
        return None
    # Over all later messages a wrong period adds up; over a few messages it hardly does.
    for ahead in (AHEAD, AHEAD, len(stamps)):
        off_s = stamps - period_s * numbers
        period_s += _measure_slope(off_s, _find_pieces(off_s, period_s, ahead))
    off_s = stamps - period_s * numbers
    shifts_s, sure = np.zeros(len(stamps)), np.zeros(len(stamps), dtype=bool)
    for piece in _find_pieces(off_s, period_s, len(stamps)):
        shifts_s[piece] = np.quantile(off_s[piece], EARLIEST)
        broken_off = 0 if piece.stop == len(stamps) else decisions.LONGEST_FILL + 2
        sure[piece.start : piece.stop - broken_off] = piece.stop - piece.start >= BLOCK
    off_s -= shifts_s
    if np.mean(sure & _find_punctual(off_s, period_s)) < decisions.CLOCK_LEAST_SURE:
        return None
    begin_s = float(shifts_s[0])
    clock = EvenClock(period_s, numbers, begin_s, off_s, shifts_s - begin_s)
    return clock, sure


def _find_punctual(off_s: Floats, period_s: float) -> Mask:
    """Return which messages (n,) are of a block whose earliest is within half a period in time.

    off_s: (n,) stamp less the time on the clock.
    """
    starts = np.arange(0, len(off_s), BLOCK)
    in_time = np.abs(np.minimum.reduceat(off_s, starts)) < 0.5 * period_s
    return in_time.repeat(BLOCK)[: len(off_s)]


def _find_pieces(off_s: Floats, period_s: float, ahead: int) -> list[slice]:
    """Return the pieces between pauses, in each of which the clock goes on evenly.

    off_s: (n,) stamp less the periods since the first.
    ahead: messages, of which the earliest lies on the clock.
    """
    if ahead >= len(off_s):
        clock_s = np.minimum.accumulate(off_s[::-1])[::-1]
    else:
        clock_s = minimum_filter1d(off_s, ahead, mode="nearest", origin=-(ahead // 2))
    cuts = np.flatnonzero(np.diff(clock_s) > 0.5 * period_s) + 1
    cuts = cuts[cuts < len(off_s) - BLOCK]  # few messages at the end have none in time
    return [slice(int(a), int(b)) for a, b in pairwise([0, *cuts, len(off_s)])]


def _measure_slope(off_s: Floats, pieces: list[slice]) -> float:
    """Return by how much (s) the period is longer, from the earliest messages of blocks."""
    products = squares = 0.0
    for piece in pieces:
        length = piece.stop - piece.start
        if length < 4 * BLOCK:
            continue
        blocks = np.array_split(np.arange(piece.start, piece.stop), length // BLOCK)
        at = np.array([block[np.argmin(off_s[block])] for block in blocks])
        late_s = np.abs(off_s[at] - np.median(off_s[at]))
        at = at[late_s <= 4.0 * np.median(late_s)]  # a block may lie in a burst
        centred = at - at.mean()
        products += float(centred @ off_s[at])
        squares += float(centred @ centred)
    return products / squares if squares else 0.0
