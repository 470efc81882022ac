"""When commands acted: as they were logged, or evenly, as they were sent.

A busy computer logs a command later than it acts. Where commands came evenly but were logged
unevenly, the cart's acceleration decides between the stamps and an even clock through the earliest
of them; where it cannot tell, they count as sent evenly. Where inside the spread of the stamps the
clock really lies is known to no recording of one computer: a delay is then known to that spread
only.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.even_clock import find_even_clock
from pendulum_sysid.reading.raw import RawRecording

Spread = Callable[[RawRecording], float]  # m/s^2, of what the commands leave unexplained


def retime_commands(
    raw: RawRecording, period_s: float, measure_unexplained: Spread
) -> tuple[RawRecording, float]:
    """Return the recording with commands at the times at which they acted, and the spread (s).

    period_s: between samples.
    measure_unexplained: says how badly commands explain the cart.

    The spread is 0 where the stamps are even, the commands come at another rate than the samples,
    or the cart follows the stamps.
    """
    clock = find_even_clock(raw.command_stamp_s)
    if clock is None or abs(clock.period_s / period_s - 1.0) > decisions.SAME_RATE:
        return raw, 0.0
    if clock.spread_s <= decisions.COMMAND_SPREAD * period_s:
        return raw, 0.0
    earliest, *later = (
        replace(raw, command_stamp_s=clock.times_s + shift_s)
        for shift_s in (clock.earliest_s, 0.0, clock.latest_s)
    )
    clear = decisions.COMMAND_TIMES_RATIO * measure_unexplained(earliest)
    if measure_unexplained(raw) < clear:
        return raw, 0.0
    best = min(later, key=measure_unexplained)
    even = best if measure_unexplained(best) < clear else earliest
    return even, clock.spread_s
