"""Find where the commands are missing, and so what drove the cart is unknown.

A publisher that sends a command each period leaves a hole when messages are lost or it stops. A
few missing commands are interpolated. Over a longer hole nothing is known, unless 0 was commanded
before it: a rig whose commands end with 0 is left alone. A driver on a busy computer publishes
unevenly, and often several commands a sample; where it falls silent for longer than a few samples,
another program may have spoken (a companion that sends 0), and the command is unknown as well. A
publisher that sends changes only has no period, and leaves no holes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import PchipInterpolator

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.detector import Fault, Interval, Samples
from pendulum_sysid.cleaning.even_clock import find_even_clock
from pendulum_sysid.errors import UnusableRecording
from pendulum_sysid.reading.raw import RawRecording
from pendulum_twin.arrays import Floats, Ints, Mask


@dataclass(frozen=True)
class Holes:
    """Hold where commands are missing.

    raw: the recording, single missing commands interpolated.
    intervals_s: in which the command is unknown, s from the first sample.
    doubtful_s: periods in which a command is missing and the command jumps.
    silent_s: long holes after a command of 0, and the time before the first command: the rig was
        left alone, or commands were lost.
    """

    raw: RawRecording
    intervals_s: tuple[Interval, ...] = ()
    doubtful_s: tuple[Interval, ...] = ()
    silent_s: tuple[Interval, ...] = ()


def find_command_holes(raw: RawRecording) -> Holes:
    """Fill single missing commands, and find the longer holes.

    Raises UnusableRecording when so many commands are missing, one by one, that what drove the
    cart is unknown everywhere.
    """
    raw = _drop_repeats(raw)
    if raw.cart is None or len(raw.command) < decisions.LEAST_SAMPLES:
        return Holes(raw)
    clock = find_even_clock(raw.command_stamp_s)
    if clock is not None:
        period_s, missing = clock.period_s, np.diff(clock.numbers) - 1
    else:
        period_s, missing = _count_missing(raw)
    _check_enough(raw.command, missing)
    times, end_s = raw.command_stamp_s, float(raw.state_stamp_s[-1])
    long = np.flatnonzero(missing > decisions.LONGEST_FILL)
    holes = [(float(times[k]), float(times[k + 1]), float(raw.command[k])) for k in long]
    if float(times[0]) > (decisions.LONGEST_FILL + 1) * period_s:
        holes.append((-period_s, float(times[0]), 0.0))  # a margin of a period follows
    if end_s - float(times[-1]) > (decisions.LONGEST_FILL + 1) * period_s:
        holes.append((float(times[-1]), end_s, float(raw.command[-1])))
    jumps = _find_jumps(raw.command, missing)
    return Holes(
        _interpolate(raw, missing),
        tuple(_add_margins(hole, period_s) for hole in holes if hole[2] != 0.0),
        tuple((float(times[k]) + period_s, float(times[k + 1])) for k in jumps),
        tuple(_add_margins(hole, period_s) for hole in holes if hole[2] == 0.0),
    )


def _count_missing(raw: RawRecording) -> tuple[float, Ints]:
    """Return the samples' period (s), and how many of them each longer silence lasts, (m - 1,).

    Infinite and none where the publisher sends changes only: the command then lasts through a
    silence. Such a publisher sends no command again, unless after a silence.
    """
    period_s = float(np.median(np.diff(raw.state_stamp_s)))
    steps = np.diff(raw.command_stamp_s)
    missing = (steps / max(period_s, 1e-9)).astype(np.int64) - 1
    silent = missing > decisions.LONGEST_FILL
    if np.median(steps) > period_s or not np.any(_find_repeats(raw.command) & ~silent):
        return np.inf, np.zeros(len(steps), dtype=np.int64)
    return period_s, np.where(silent, missing, 0)


def _find_repeats(command: Floats) -> Mask:
    """Return which commands are the same as the command before, (m - 1,)."""
    repeats: Mask = command[1:] == command[:-1]
    return repeats


def _add_margins(hole: tuple[float, float, float], period_s: float) -> Interval:
    """Return the interval in which the command is unknown, for a hole (begin, end, held)."""
    return hole[0] + period_s, hole[1] + decisions.COMMAND_MEMORY_S


def _drop_repeats(raw: RawRecording) -> RawRecording:
    """Return the recording without commands that came twice: the same stamp, the same value."""
    again = (np.diff(raw.command_stamp_s) <= 0) & (np.diff(raw.command) == 0)
    if not again.any():
        return raw
    kept = np.concatenate([[True], ~again])
    return replace(raw, command_stamp_s=raw.command_stamp_s[kept], command=raw.command[kept])


def leave_out_holes(samples: Samples, holes: Holes) -> Samples:
    """Return the samples without those of which the command is unknown.

    Over a period with a doubtful command, samples before and after are of two stretches.
    """
    slack_s = 0.5 * samples.rate.period_s
    known = np.ones(len(samples.stamps), dtype=bool)
    for begin_s, end_s in holes.intervals_s:
        known &= (samples.stamps < begin_s) | (samples.stamps > end_s)
    for begin_s, end_s in holes.doubtful_s:
        known &= (samples.stamps < begin_s + slack_s) | (samples.stamps > end_s - slack_s)
    if not known.all():
        samples = samples.pick(known)
    if not holes.doubtful_s:
        return samples
    cuts = np.array([begin_s + slack_s for begin_s, _ in holes.doubtful_s])
    breaks = {
        joint: np.sort(np.concatenate([samples.breaks.get(joint, np.empty(0)), cuts]))
        for joint in samples.positions
    }
    return replace(samples, breaks=breaks)


def list_faults(holes: Holes) -> tuple[Fault, ...]:
    """Return the holes as faults."""
    intervals_s = (*holes.intervals_s, *holes.doubtful_s)
    note = "commands are missing: what drove the cart then is unknown, and is left out"
    return (Fault("gap", intervals_s, note),) if intervals_s else ()


def _find_jumps(command: Floats, missing: Ints) -> Ints:
    """Return the short holes (commands before them) over which no curve can be believed.

    The command departs there from the slopes on both sides by more than a share of its largest
    value.
    """
    short = np.flatnonzero((missing > 0) & (missing <= decisions.LONGEST_FILL))
    slope = np.diff(command) / (missing + 1)
    before, after = slope[np.maximum(short - 1, 0)], slope[np.minimum(short + 1, len(slope) - 1)]
    bend = np.abs(slope[short] - 0.5 * (before + after))
    allowed = decisions.COMMAND_JUMP_SHARE * float(np.max(np.abs(command), initial=0.0))
    return short[0.5 * bend * (missing[short] + 1) > allowed]


def _check_enough(command: Floats, missing: Ints) -> None:
    """Raise UnusableRecording when too many commands are missing one by one."""
    single = int(missing[missing <= decisions.LONGEST_FILL].sum())
    if _find_repeats(command).any() and single > decisions.MOST_NOT_FINITE * (
        len(command) + single
    ):
        raise UnusableRecording(
            f"expected a command each period, found {single} of {len(command) + single} missing "
            f"one by one: at most {decisions.MOST_NOT_FINITE:.0%} can be done without, for what "
            "drove the cart is unknown; record on the rig's own computer, or by a reliable "
            "connection"
        )


def _interpolate(raw: RawRecording, missing: Ints) -> RawRecording:
    """Return the recording with a command in each short hole, on a curve through the others."""
    finite = np.isfinite(raw.command)
    short = (missing > 0) & (missing <= decisions.LONGEST_FILL)
    if not short.any() or np.count_nonzero(finite) < 2:
        return raw
    numbers = np.concatenate([[0.0], np.cumsum(missing + 1.0)])
    filled = np.concatenate(
        [numbers[k] + np.arange(1, missing[k] + 1) for k in np.flatnonzero(short)]
    )
    curve = PchipInterpolator(numbers[finite], raw.command[finite])
    order = np.argsort(np.concatenate([numbers, filled]), kind="stable")
    times = np.concatenate([raw.command_stamp_s, np.interp(filled, numbers, raw.command_stamp_s)])
    command = np.concatenate([raw.command, np.nan_to_num(curve(filled))])
    return replace(raw, command_stamp_s=times[order], command=command[order])
