"""One uniform clock for samples and commands that come with times of their own."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pendulum_sysid import decisions
from pendulum_twin.arrays import Floats, Ints, Mask

FIT_EACH_SIDE = 5  # samples on either side that a fill is fitted to
CUBIC_LEAST_STEP = 0.5  # periods; a cubic through nearer samples would magnify their noise


@dataclass(frozen=True)
class Rate:
    """Hold how samples follow one another.

    period_s: s between samples.
    jitter: standard deviation of a stamp from its grid, in periods.
    uneven: whether samples were taken as unevenly as their stamps say.
    """

    period_s: float
    jitter: float
    uneven: bool = False

    @property
    def gap_s(self) -> float:
        """Return the step (s) from which a sample is missing: 1.5 periods, more with jitter."""
        return (1.5 + min(0.4, 2.0 * self.jitter)) * self.period_s

    @property
    def break_s(self) -> float:
        """Return the step between two stamps from which too many samples are missing to fill."""
        return (decisions.LONGEST_FILL + 1.5) * self.period_s


def estimate_rate(stamps: Floats) -> Rate:
    """Estimate the rate of rising stamps (n,): the median step, refined over whole stretches."""
    steps = np.diff(stamps)
    median = float(np.median(steps))
    cuts = np.flatnonzero(steps > (decisions.LONGEST_FILL + 1.5) * median) + 1
    products, squares, off = 0.0, 0.0, [np.zeros(1)]
    for part in np.split(stamps, cuts):
        place = number_stamps(part, median)
        products += float((place - place.mean()) @ (part - part.mean()))
        squares += float((place - place.mean()) @ (place - place.mean()))
        off.append(np.diff(part) - np.diff(place) * median)
    slope = products / squares if squares else median
    period = float(
        f"{slope if abs(slope / median - 1) < decisions.CLOCK_BELIEVED else median:.8g}"
    )
    jitter = (
        np.sqrt(np.mean(np.concatenate(off) ** 2) / 2) / period
    )  # a step has the deviations of two stamps
    return Rate(period, float(jitter))


def number_stamps(stamps: Floats, period_s: float, phase: float = 0.0) -> Floats:
    """Return the number of each stamp on a clock that follows them slowly, (n,).

    phase: periods from the first stamp to number 0 of the clock.
    """
    steps = np.diff(stamps) / period_s
    if np.all(np.abs(steps - np.rint(steps)) < decisions.CLOCK_CLEAR):
        return np.concatenate([[0.0], np.cumsum(np.rint(steps))])
    places = np.zeros(len(stamps))
    for k, time in enumerate((stamps - stamps[0]) / period_s):
        places[k] = round(time - phase)
        phase += decisions.CLOCK_FOLLOW * (time - phase - places[k])
    return places


def make_grid(stamps: Floats, period_s: float) -> Floats:
    """Return the instants (s) of the uniform clock that runs through most stamps of a stretch."""
    place = number_stamps(stamps, period_s)
    if np.ptp(stamps - place * period_s) > 2 * decisions.CLOCK_ALIGNED * period_s:
        time = (stamps - stamps[0]) / period_s
        phase = float(np.median(time - np.rint(time)))
        first, last = (
            np.ceil(-phase - decisions.CLOCK_ALIGNED),
            np.floor(time[-1] - phase + decisions.CLOCK_ALIGNED),
        )
        return stamps[0] + (phase + np.arange(first, last + 1)) * period_s
    origin = float(np.median(stamps - place * period_s))
    return origin + np.arange(place[-1] + 1) * period_s


def resample(instants: Floats, stamps: Floats, values: Floats, rate: Rate) -> tuple[Floats, Mask]:
    """Return values at the instants, (n,), and where a sample stands behind them, (n,).

    instants: (n,) s, of the uniform clock.
    stamps, values: (m,) good samples.

    A sample near its instant is taken unchanged, unless samples were taken unevenly: at 2 m/s the
    cart goes 0.8 mm in a twenty-fifth of a period of 10 ms. Elsewhere the value is that of the
    cubic through two samples on either side: on a straight line an accelerated joint would be off
    by an eighth of its acceleration times the squared period, which is more than an encoder's
    step. Where no sample is near, the value is a smooth fill and not valid.
    """
    valid = np.zeros(len(instants), dtype=bool)
    if len(stamps) < 2:
        return np.zeros(len(instants)), valid
    right = np.clip(np.searchsorted(stamps, instants), 1, len(stamps) - 1)
    nearest = right - (instants - stamps[right - 1] < stamps[right] - instants)
    hit = np.abs(stamps[nearest] - instants) <= 2 * decisions.CLOCK_ALIGNED * rate.period_s
    between = (
        (stamps[right] - stamps[right - 1] < rate.gap_s)
        & (instants >= stamps[0])
        & (instants <= stamps[-1])
    )
    valid = hit | between
    if rate.uneven:
        hit &= ~between
    out = np.where(hit, values[nearest], _interpolate(instants, stamps, values, right, rate))
    return fill(out, valid), valid


def _interpolate(
    instants: Floats, stamps: Floats, values: Floats, right: Ints, rate: Rate
) -> Floats:
    """Return the values at the instants, (n,), on cubics through two samples on either side.

    Where a sample is missing among the four, or two stand so near each other that the cubic would
    magnify their noise, the value lies on the line through the neighbours.

    right: (n,) number of the first sample behind each instant, 1 at least.
    """
    out: Floats = np.interp(instants, stamps, values)
    steps = np.diff(stamps)
    even = (steps > CUBIC_LEAST_STEP * rate.period_s) & (steps < rate.gap_s)
    inside = (right > 1) & (right < len(stamps) - 1)
    rows = np.flatnonzero(inside)
    at = right[rows]
    whole = even[at - 2] & even[at - 1] & even[at]
    rows, at = rows[whole], at[whole]
    nodes = [at - 2, at - 1, at, at + 1]
    cubic = np.zeros(len(rows))
    for node in nodes:
        others = [other for other in nodes if other is not node]
        factors = [
            (instants[rows] - stamps[other]) / (stamps[node] - stamps[other]) for other in others
        ]
        cubic += np.prod(factors, axis=0) * values[node]
    out[rows] = cubic
    return out


def fill(values: Floats, valid: Mask) -> Floats:
    """Replace values that are not valid: short runs by a cubic, the ends by a line."""
    out = values.copy()
    good = np.flatnonzero(valid)
    if len(good) < 2:
        return out
    bad = ~valid
    out[bad] = np.interp(np.flatnonzero(bad), good, values[good])
    for start, stop in find_runs(bad):
        at = np.searchsorted(good, start)
        near = good[max(0, at - FIT_EACH_SIDE) : at + FIT_EACH_SIDE]
        inside = start > good[0] and stop <= good[-1]
        if stop - start > decisions.LONGEST_FILL or len(near) < 4:
            continue
        fit = np.polyfit(near - start, values[near], 3 if inside else 1)
        out[start:stop] = np.polyval(fit, np.arange(stop - start))
    return out


def find_runs(mask: Mask) -> list[tuple[int, int]]:
    """Return start and stop (exclusive) of every run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]])))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def hold_commands(
    instants: Floats, period_s: float, stamps: Floats, command: Floats, nearest: bool | None = None
) -> Floats:
    """Return the command in force from each instant to the next one; 0 before the first message.

    stamps, command: (m,) when each message came, and its value, which is held until the next.
    nearest: True where each message acts from the nearest instant on, False where it acts at once:
        the held command is averaged over each period. None: True when nearly every message came
        close to an instant, as answers to samples do.
    """
    if not len(stamps):
        return np.zeros(len(instants))
    if _is_paired(instants, period_s, stamps) if nearest is None else nearest:
        latest = np.searchsorted(stamps, instants + 0.5 * period_s, side="right") - 1
        return np.where(latest >= 0, command[latest], 0.0)
    end = max(stamps[-1], instants[-1]) + 2 * period_s
    knots = np.append(stamps, end)
    integral = np.concatenate([[0.0], np.cumsum(command * np.diff(knots))])
    upto = np.interp(np.concatenate([instants, instants + period_s]), knots, integral).reshape(
        2, -1
    )
    return (upto[1] - upto[0]) / period_s


def count_parts(period_s: float, stamps: Floats, uneven: bool) -> int:
    """Return in how many parts of a sample period commands come; 1 where they are no faster.

    Faster commands follow a clock of their own. Several uneven commands a period are answers to
    one sample, as a busy computer sends them. Where samples were taken unevenly, the rig waits for
    no clock, and commands act when they come: anywhere between two instants, so in as many parts
    as can be. No part is shorter than a step of the search, which averages over what is faster.

    stamps: (m,) s, when each command came, rising.
    uneven: whether samples were taken as unevenly as their stamps say.
    """
    if len(stamps) < 2:
        return 1
    if uneven:
        return max(int(period_s // decisions.SEARCH_STEP_S), 1)
    steps = np.diff(stamps)
    median = max(float(np.median(steps)), 1e-9)
    even = np.abs(steps / median - 1.0) < decisions.CLOCK_CLEAR
    parts = period_s / median
    if parts < decisions.COMMANDS_FASTER or np.mean(even) < decisions.COMMANDS_EVEN:
        return 1
    return int(np.clip(np.ceil(parts - 0.1), 1, max(period_s // decisions.SEARCH_STEP_S, 1)))


def hold_parts(
    instants: Floats, period_s: float, stamps: Floats, command: Floats, count: int
) -> Floats:
    """Return the command in so many equal parts of the period from each instant on, (n, count).

    stamps, command: (m,) when each message came, and its value, which is held until the next.
    """
    part_s = period_s / count
    begins = (instants[:, None] + part_s * np.arange(count)).reshape(-1)
    return hold_commands(begins, part_s, stamps, command, nearest=False).reshape(-1, count)


def _is_paired(instants: Floats, period_s: float, stamps: Floats) -> bool:
    right = np.clip(np.searchsorted(instants, stamps), 1, len(instants) - 1)
    off = (
        np.minimum(np.abs(instants[right] - stamps), np.abs(stamps - instants[right - 1]))
        / period_s
    )
    inside = off <= 0.6  # not before, between or after the stretches
    return not np.any(inside) or bool(np.mean(off[inside] <= decisions.COMMAND_PAIRED) >= 0.95)
