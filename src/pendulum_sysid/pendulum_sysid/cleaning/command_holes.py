"""Find where the commands are missing, and so what drove the cart is unknown.

A publisher that sends a command each period leaves a hole when messages are lost or it stops. A
few missing commands are interpolated. Over a longer hole nothing is known, unless 0 was commanded
before it: a rig whose commands end with 0 is left alone. A publisher that sends changes only has
no period, and leaves no holes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.detector import Fault, Interval, Samples
from pendulum_sysid.cleaning.even_clock import find_even_clock
from pendulum_sysid.errors import UnusableRecording
from pendulum_sysid.reading.raw import RawRecording


@dataclass(frozen=True)
class Holes:
    """Hold where commands are missing.

    raw: the recording, single missing commands interpolated.
    intervals_s: in which the command is unknown, s from the first sample.
    """

    raw: RawRecording
    intervals_s: tuple[Interval, ...] = ()


def find_command_holes(raw: RawRecording) -> Holes:
    """Fill single missing commands, and find the longer holes.

    Raises UnusableRecording when so many commands are missing, one by one, that what drove the
    cart is unknown everywhere.
    """
    raw = _drop_repeats(raw)
    if raw.cart is None or len(raw.command) < decisions.LEAST_SAMPLES:
        return Holes(raw)
    clock = find_even_clock(raw.command_stamp_s)
    if clock is None:
        return Holes(raw)
    missing = np.diff(clock.numbers) - 1
    _check_enough(raw.command, missing)
    times, end_s = raw.command_stamp_s, float(raw.state_stamp_s[-1])
    long = np.flatnonzero(missing > decisions.LONGEST_FILL)
    holes = [(float(times[k]), float(times[k + 1])) for k in long if raw.command[k] != 0.0]
    after = end_s - float(times[-1])
    if after > (decisions.LONGEST_FILL + 1) * clock.period_s and raw.command[-1] != 0.0:
        holes.append((float(times[-1]), end_s))
    margins = clock.period_s, decisions.COMMAND_MEMORY_S
    return Holes(
        _interpolate(raw, missing), tuple((a + margins[0], b + margins[1]) for a, b in holes)
    )


def _drop_repeats(raw: RawRecording) -> RawRecording:
    """Return the recording without commands that came twice: the same stamp, the same value."""
    again = (np.diff(raw.command_stamp_s) <= 0) & (np.diff(raw.command) == 0)
    if not again.any():
        return raw
    kept = np.concatenate([[True], ~again])
    return replace(raw, command_stamp_s=raw.command_stamp_s[kept], command=raw.command[kept])


def leave_out_holes(samples: Samples, intervals_s: tuple[Interval, ...]) -> Samples:
    """Return the samples without those of which the command is unknown."""
    known = np.ones(len(samples.stamps), dtype=bool)
    for begin_s, end_s in intervals_s:
        known &= (samples.stamps < begin_s) | (samples.stamps > end_s)
    return samples if known.all() else samples.pick(known)


def list_faults(intervals_s: tuple[Interval, ...]) -> tuple[Fault, ...]:
    """Return the holes as faults."""
    note = "commands are missing: what drove the cart then is unknown, and is left out"
    return (Fault("gap", intervals_s, note),) if intervals_s else ()


def _check_enough(command: Floats, missing: np.ndarray) -> None:
    """Raise UnusableRecording when too many commands are missing one by one."""
    single = int(missing[missing <= decisions.LONGEST_FILL].sum())
    sends_each = bool(np.any(command[1:] == command[:-1]))  # or only changes would be sent
    if sends_each and single > decisions.MOST_NOT_FINITE * (len(command) + single):
        raise UnusableRecording(
            f"expected a command each period, found {single} of {len(command) + single} missing "
            f"one by one: at most {decisions.MOST_NOT_FINITE:.0%} can be done without, for what "
            "drove the cart is unknown; record on the rig's own computer, or by a reliable "
            "connection"
        )


def _interpolate(raw: RawRecording, missing: np.ndarray) -> RawRecording:
    """Return the recording with a command in each short hole, on the line across it."""
    short = (missing > 0) & (missing <= decisions.LONGEST_FILL)
    if not short.any():
        return raw
    places = [np.arange(len(raw.command), dtype=np.float64)]
    for k in np.flatnonzero(short):
        places.append(k + np.arange(1, missing[k] + 1) / (missing[k] + 1.0))
    at = np.sort(np.concatenate(places))
    order = np.arange(len(raw.command))
    return replace(
        raw,
        command_stamp_s=np.interp(at, order, raw.command_stamp_s),
        command=np.interp(at, order, raw.command),
    )
