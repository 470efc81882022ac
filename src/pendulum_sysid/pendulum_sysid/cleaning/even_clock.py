"""Messages that were sent evenly and stamped unevenly: their order tells their time better."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import median_filter

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.clock import estimate_rate, number_stamps
from pendulum_twin.arrays import Floats, Ints

BLOCK = 200  # messages, of which a median says whether some before them were lost
REACH = 20  # messages, over which the period is measured before any is numbered


@dataclass(frozen=True)
class EvenClock:
    """Hold the even clock that runs through the stamps of (n,) messages.

    period_s: s from message to message.
    numbers: (n,) of each message on the clock, from 0; rising.
    begin_s: time of number 0: half of the stamps lie before the clock, half behind it. Where the
        sender pauses, the earliest 5 % of the stamps lie before it.
    off_s: (n,) stamp minus time on the clock.
    shifts_s: (n,) by how much pauses have moved the clock; 0 for none.
    """

    period_s: float
    numbers: Ints
    begin_s: float
    off_s: Floats
    shifts_s: Floats | float = 0.0

    @property
    def times_s(self) -> Floats:
        """Return the time of each message on the clock, (n,)."""
        times: Floats = self.begin_s + self.period_s * self.numbers.astype(np.float64)
        return times + self.shifts_s

    @property
    def spread_s(self) -> float:
        """Return how far apart the earliest and the latest stamps lie beside the clock, s."""
        low, high = np.quantile(self.off_s, [0.05, 0.95])
        return float(high - low)

    @property
    def earliest_s(self) -> float:
        """Return how far the earliest stamps lie before the clock, s; negative."""
        return float(np.quantile(self.off_s, 0.05))

    @property
    def latest_s(self) -> float:
        """Return how far the latest stamps lie behind the clock, s."""
        return float(np.quantile(self.off_s, 0.95))


def find_even_clock(stamps: Floats) -> EvenClock | None:
    """Return the even clock of stamps (n,) that never fall; None where there is none.

    None for stamps that are so uneven that a lost message cannot be told from a late one.
    """
    if len(stamps) < decisions.LEAST_SAMPLES:
        return None
    for number in (_number_by_steps, _number_by_phase, _number_in_order):
        numbers = number(stamps)
        if numbers is not None:
            return _fit_clock(stamps, numbers.astype(np.int64))
    return None


def _number_by_steps(stamps: Floats) -> Floats | None:
    """Return the numbers of messages whose steps are whole periods; None where they are not."""
    period_s = float(np.median(np.diff(stamps)))
    if not period_s > 0.0:
        return None
    steps = np.diff(stamps) / period_s
    whole = (np.abs(steps - np.rint(steps)) < decisions.CLOCK_CLEAR) & (np.rint(steps) >= 1)
    if np.mean(whole) < decisions.CLOCK_MOST_WHOLE:
        return None
    burst = ~whole
    ends = burst & np.append(whole[1:], True)
    counts = np.where(whole, np.rint(steps), 0.0)
    # messages that were held back come in a burst, whose steps together are whole periods again
    counts[ends] = np.rint(np.diff(np.cumsum(np.where(whole, 0.0, steps))[ends], prepend=0.0))
    numbers = np.cumsum(counts)
    numbers[burst & ~ends] = np.inf  # known by the messages after them
    numbers = np.concatenate([[0.0], numbers]) - np.arange(len(stamps))
    # a message that was held back, and thus comes late, has the number that later messages leave
    return np.minimum.accumulate(numbers[::-1])[::-1] + np.arange(len(stamps))


def _number_by_phase(stamps: Floats) -> Floats | None:
    """Return the numbers of messages that stray from a followed clock by less than half a period.

    The few that stray further take the number that their neighbours leave. None where more than a
    few stray: a lost message cannot be told from a late message there. None where more messages
    were lost than came: on a clock that is fast enough all stamps lie.
    """
    if not np.median(np.diff(stamps)) > 0.0:
        return None
    read = number_stamps(stamps, estimate_rate(stamps).period_s)
    period_s = _measure_period(stamps, read)
    off = (stamps - stamps[0]) / period_s - read
    # the first stamp may be off the clock: followed from the clock's phase, it has its number, too
    read = number_stamps(stamps, period_s, float(np.median(off[:BLOCK])))
    order = np.arange(len(stamps))
    # so many are lost before each message: they never fall, as dense as losses come, and a running
    # median leaves alone what never falls
    lost = median_filter(read - order, REACH + 1, mode="nearest")
    if np.any(np.diff(lost) < 0) or np.ptp(lost) > len(stamps):
        return None
    numbers: Floats = order + lost
    most = np.mean(read == numbers) >= decisions.CLOCK_MOST_WHOLE
    return numbers - numbers[0] if most else None


def _number_in_order(stamps: Floats) -> Floats | None:
    """Return the numbers of messages of which none was lost but in gaps; None otherwise."""
    period_s = float(np.median(stamps[REACH:] - stamps[:-REACH])) / REACH
    if not period_s > 0.0 or len(stamps) < 2 * BLOCK:
        return None
    numbers = np.arange(len(stamps), dtype=np.float64)
    off = stamps / period_s - numbers
    for k in np.flatnonzero(np.diff(stamps) > (decisions.LONGEST_FILL + 1.5) * period_s):
        # a pause with messages held back ends in a burst; one in which messages were lost does not
        before = np.median(off[max(k - REACH, 0) : k + 1])
        later = off[k + 1 : k + REACH], off[k + REACH : k + 2 * REACH]  # a long burst lasts
        after = min(np.median(part) for part in later if len(part))
        numbers[k + 1 :] += max(np.rint(after - before), 0.0)
        off[k + 1 :] -= max(np.rint(after - before), 0.0)
    blocks = np.array([np.median(part) for part in np.array_split(off, len(off) // BLOCK)])
    return numbers if np.all(np.abs(np.diff(blocks)) < 0.5) else None


def _fit_clock(stamps: Floats, numbers: Ints) -> EvenClock | None:
    """Return the clock whose line through numbers and stamps leaves the least squares."""
    period_s = _measure_period(stamps, numbers)
    off_s = stamps - period_s * numbers
    begin_s = float(np.median(off_s))
    off_s = off_s - begin_s
    if np.quantile(np.abs(off_s), 0.95) > decisions.CLOCK_LATEST * period_s:
        return None  # the stamps wander: two clocks, or messages that were lost
    return EvenClock(period_s, numbers, begin_s, off_s)


def _measure_period(stamps: Floats, numbers: Floats | Ints) -> float:
    """Return the slope (s) of the line through numbers and stamps (n,) by least squares."""
    centred = numbers - numbers.mean()
    return float(centred @ (stamps - stamps.mean()) / (centred @ centred))
