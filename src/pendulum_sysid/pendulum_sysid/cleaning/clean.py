"""Clean a recording: put it on one clock, mark what sensors and recorder got wrong, and say so."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.acting_samples import settle_commands
from pendulum_sysid.cleaning.clipping import detect_clipping
from pendulum_sysid.cleaning.clock import (
    Rate,
    count_parts,
    estimate_rate,
    hold_commands,
    hold_parts,
    make_grid,
    resample,
)
from pendulum_sysid.cleaning.command_answer import is_moved_uncommanded, measure_unexplained
from pendulum_sysid.cleaning.command_arrivals import find_clock_bounds, list_arrivals
from pendulum_sysid.cleaning.command_holes import (
    Holes,
    find_command_holes,
    leave_out_holes,
    list_faults,
)
from pendulum_sysid.cleaning.command_times import retime_commands
from pendulum_sysid.cleaning.detector import Detector, Fault, Interval, Samples, Track
from pendulum_sysid.cleaning.encoder_steps import find_encoder_step
from pendulum_sysid.cleaning.foreign_start import detect_foreign_start
from pendulum_sysid.cleaning.frozen import detect_frozen
from pendulum_sysid.cleaning.gaps import detect_gaps
from pendulum_sysid.cleaning.jitter import detect_jitter
from pendulum_sysid.cleaning.other_command import detect_other_command
from pendulum_sysid.cleaning.reducing import is_too_fast, reduce_rate
from pendulum_sysid.cleaning.repeats import find_usable_rows
from pendulum_sysid.cleaning.retiming import retime_samples
from pendulum_sysid.cleaning.sensor_end import detect_sensor_end
from pendulum_sysid.cleaning.smooth_state import smooth_state
from pendulum_sysid.cleaning.spikes import detect_spikes
from pendulum_sysid.cleaning.velocity_spikes import detect_velocity_spikes
from pendulum_sysid.cleaning.wraps import detect_wraps
from pendulum_sysid.command_doubt import CommandDoubt
from pendulum_sysid.errors import UnusableRecording
from pendulum_sysid.reading.raw import JOINTS, RawRecording, suggest_more
from pendulum_sysid.records import FaultKind, QualityFinding, Recording
from pendulum_twin.arrays import Floats, Mask
from pendulum_twin.signals import Signals

DETECTORS: tuple[Detector, ...] = (
    detect_gaps,
    detect_jitter,
    detect_wraps,
    detect_frozen,
    detect_sensor_end,
    detect_spikes,
    detect_foreign_start,
    detect_velocity_spikes,
    detect_clipping,
    detect_other_command,
)
TINY = 1e-300  # the commands of a simulation may leave nothing
SPIKE_ECHO_PERIODS = 1.5  # a position's spike echoes in the velocity that was computed from it
OTHER_COMMAND_S = 0.5  # intervals of other commands that are nearer are told as one interval


def clean_recording(raw: RawRecording) -> Recording:
    """Put a recording on one uniform clock, with the findings of the detectors.

    Missing samples and spikes keep their place, filled and marked as not valid. A longer gap, a
    frozen driver, a jump that stays or a hole in the commands begins a new stretch. Commands are
    held from message to message, 0 before the first. Rates beyond 1 kHz are reduced. Findings,
    each with a count and intervals (s from the first sample):

    spike: samples out of line in a position or a reported velocity (a velocity invalidates
        nothing).
    gap: samples or commands missing, not finite or lost with a part of the file, and jumps that
        stay.
    jitter: stamps off their grid.
    wrap: jumps by whole turns, undone.
    stale: samples that came twice, a sensor that stood still while the rig moved, or a beginning
        that belongs to another run.
    clipped: a command at its limit, which is no fault, or a sensor at its end.
    other_command: the driver sent other commands than were read.

    Raises UnusableRecording when fewer than 100 samples or less than 2 s are left, and when more
    than 5 % of the commands are missing.
    """
    rows, repeats = find_usable_rows(raw)
    retimed = retime_samples(raw, rows)
    holes = find_command_holes(retimed.raw)
    samples = _start_samples(holes.raw, retimed.rows, retimed.uneven)
    faults = [*repeats, *retimed.faults]
    for detect in DETECTORS:
        samples, detected = detect(samples)
        faults += detected
    samples = leave_out_holes(samples, holes)
    signals = _put_on_one_clock(samples)
    silent_s = _find_uncommanded(signals, holes.silent_s)
    if silent_s:
        samples = leave_out_holes(samples, Holes(holes.raw, silent_s))
        signals = _put_on_one_clock(samples)
    faults += list_faults(replace(holes, intervals_s=(*holes.intervals_s, *silent_s)))
    commanded, spread_s, doubt = _set_command_times(samples, signals, retimed.placed)
    at_once = _hold_at_once(samples.raw, commanded)
    commanded = reduce_rate(commanded)
    rates = _resample_velocities(samples, commanded)
    return Recording(
        raw.name,
        raw.digest,
        commanded,
        _list_findings(faults, samples.rate.period_s),
        rates,
        retimed.spread_s + spread_s,
        raw.command_latency,
        doubt,
        at_once,
        find_encoder_step(samples.positions.get("pole")),
    )


def _find_uncommanded(signals: Signals, intervals_s: tuple[Interval, ...]) -> tuple[Interval, ...]:
    """Return the intervals without commands in which the cart moves as if it were commanded."""
    if not intervals_s or signals.cart is None or not np.any(signals.command):
        return ()
    state = smooth_state(signals)
    return tuple(span for span in intervals_s if is_moved_uncommanded(signals, state, *span))


def _set_command_times(
    samples: Samples, signals: Signals, placed: bool
) -> tuple[Signals, float, CommandDoubt | None]:
    """Return the signals with commands at the times at which they acted, and their spread, s.

    Returns the commands that are in doubt, too; None where there are none.

    placed: whether samples and commands stand on one clock.
    """
    if signals.cart is None or not np.any(signals.command):
        return signals, 0.0, None
    smoothed = cache(lambda: smooth_state(signals))  # takes time, and few recordings need it

    def measure(commanded: Signals) -> float:
        return measure_unexplained(commanded, smoothed())

    raw, spread_s = samples.raw, 0.0
    if not samples.rate.uneven:  # a loop sends commands as unevenly as it takes samples
        raw, spread_s = retime_commands(
            raw, signals.period_s, lambda raw: measure(_hold(raw, signals))
        )
    parts = count_parts(signals.period_s, _list_commands(raw)[0], samples.rate.uneven)
    if parts > 1:
        return _hold_parts(raw, signals, parts), spread_s, None
    retimed = signals if raw is samples.raw else _hold(raw, signals)
    arrivals = list_arrivals(signals, *_list_commands(raw))
    bounds = find_clock_bounds(placed, signals.period_s)
    unsettled = arrivals.weigh(bounds.expected)
    nearest = _hold(raw, signals, nearest=True)
    answering = replace(nearest, command=unsettled.put_into(nearest.command))
    settled, doubt = settle_commands(answering, smoothed, arrivals, bounds)
    if np.array_equal(nearest.command, retimed.command):
        return settled, spread_s, doubt
    best = min((settled, answering), key=measure)
    ratio = measure(retimed) / max(measure(best), TINY)
    if len(signals) * math.log(max(ratio, TINY)) > decisions.COMMAND_MOVED_NATS:
        return best, spread_s, doubt if best is settled else unsettled.pick_doubtful()
    return retimed, spread_s, None


def _hold_at_once(raw: RawRecording, signals: Signals) -> Floats | None:
    """Return the commands (n,) as they act on a rig that waits for no sample.

    None where they came so near the samples that this makes no difference.
    """
    if signals.cart is None or signals.parts is not None or is_too_fast(signals):
        return None
    command = _hold(raw, signals, nearest=False).command
    moved = float(np.mean(np.abs(command - signals.command)))
    change = float(np.mean(np.abs(np.diff(signals.command))))
    return command if moved > decisions.CLOCK_ALIGNED * change else None


def _list_commands(raw: RawRecording) -> tuple[Floats, Floats]:
    """Return when the finite commands came, (m,), s, and their values."""
    finite = np.isfinite(raw.command)
    return raw.command_stamp_s[finite], raw.command[finite]


def _hold(raw: RawRecording, signals: Signals, nearest: bool | None = None) -> Signals:
    """Return the signals with the recording's commands held as `hold_commands` says."""
    command = hold_commands(signals.clock_s, signals.period_s, *_list_commands(raw), nearest)
    return replace(signals, command=command)


def _hold_parts(raw: RawRecording, signals: Signals, count: int) -> Signals:
    """Return the signals with the commands of each period in so many parts."""
    parts = hold_parts(signals.clock_s, signals.period_s, *_list_commands(raw), count)
    return replace(signals, command=parts.mean(axis=1), parts=parts)


def _start_samples(raw: RawRecording, rows: Mask, uneven: bool) -> Samples:
    """Return the usable rows (n,) of a recording with the rate of their stamps.

    uneven: whether the samples were taken as unevenly as their stamps say.
    """
    stamps = raw.state_stamp_s[rows]
    _check_enough(raw, len(stamps), float(np.ptp(stamps)) if len(stamps) else 0.0)
    positions = {joint: values[rows] for joint, values in raw.positions.items()}
    rate = replace(estimate_rate(stamps), uneven=uneven)
    return Samples(raw, rows, rate, stamps, positions)


def _check_enough(raw: RawRecording, samples: int, seconds: float) -> None:
    if samples < decisions.LEAST_SAMPLES or seconds < decisions.LEAST_SECONDS:
        raise UnusableRecording(
            f"expected at least {decisions.LEAST_SAMPLES} usable samples and "
            f"{decisions.LEAST_SECONDS:g} s, found {samples} samples in {seconds:.3g} s"
            f"{suggest_more(raw.cut_short)}"
        )


def _put_on_one_clock(samples: Samples) -> Signals:
    """Return all stretches resampled, one after another."""
    raw, rate, stamps = samples.raw, samples.rate, samples.stamps
    tracks = {joint: samples.get_track(joint) for joint in samples.positions}
    stretches = _list_stretches(stamps, tracks.values(), rate)
    grids = [make_grid(stamps[a:b], rate.period_s) for a, b in stretches]
    instants = np.concatenate([np.empty(0), *grids])
    columns: dict[str, Floats | None] = dict.fromkeys(JOINTS)
    valid = {joint: np.zeros(len(instants), dtype=bool) for joint in JOINTS}
    for joint, track in tracks.items():
        pieces = [
            _resample_track(track, stamps[a], stamps[b - 1], grid, rate)
            for (a, b), grid in zip(stretches, grids, strict=True)
        ]
        columns[joint] = np.concatenate([np.empty(0), *(values for values, _ in pieces)])
        valid[joint] = np.concatenate([np.empty(0, dtype=bool), *(good for _, good in pieces)])
    _check_enough(raw, len(instants), len(instants) * rate.period_s)
    return Signals(
        period_s=rate.period_s,
        command=hold_commands(instants, rate.period_s, *_list_commands(raw)),
        cart=columns["cart"],
        pole=columns["pole"],
        cart_valid=valid["cart"],
        pole_valid=valid["pole"],
        stretch_begins=tuple(int(k) for k in np.cumsum([0, *(len(grid) for grid in grids[:-1])])),
        begin_s=tuple(float(grid[0]) for grid in grids),
        interpolated=rate.uneven,
    )


def _list_stretches(stamps: Floats, tracks: Iterable[Track], rate: Rate) -> list[tuple[int, int]]:
    """Return the (first, stop) samples of the stretches that are long enough."""
    breaks = [np.flatnonzero(np.diff(stamps) > rate.break_s) + 1]
    breaks += [np.searchsorted(stamps, track.breaks, side="right") for track in tracks]
    edges = np.unique(np.concatenate([[0, len(stamps)], *breaks])).astype(int).tolist()
    return [(a, b) for a, b in pairwise(edges) if b - a >= decisions.SHORTEST_STRETCH]


def _resample_track(
    track: Track, begin_s: float, end_s: float, instants: Floats, rate: Rate
) -> tuple[Floats, Mask]:
    inside = (track.stamps >= begin_s) & (track.stamps <= end_s)
    return resample(instants, track.stamps[inside], track.values[inside], rate)


def _resample_velocities(samples: Samples, signals: Signals) -> Floats | None:
    """Return the reported velocities on the signals' clock, (n, 2), NaN where there are none.

    None when the recording reports none at all.
    """
    rates = np.full((len(signals), len(JOINTS)), np.nan)
    for k, joint in enumerate(JOINTS):
        values = samples.raw.get_velocity(joint)
        if values is not None and np.isfinite(values[samples.rows]).sum() > 1:
            there = samples.rows & np.isfinite(values)
            stamps = samples.raw.state_stamp_s[there]
            column, valid = resample(signals.clock_s, stamps, values[there], samples.rate)
            rates[:, k] = np.where(valid, column, np.nan)
    return rates if np.any(np.isfinite(rates)) else None


def _list_findings(faults: Iterable[Fault], period_s: float) -> tuple[QualityFinding, ...]:
    """Return one finding a kind; faults of several sensors at one time count once."""
    intervals: dict[FaultKind, list[Interval]] = {}
    notes: dict[FaultKind, list[str]] = {}
    for fault in faults:
        intervals.setdefault(fault.kind, []).extend(fault.intervals_s)
        notes.setdefault(fault.kind, []).extend(
            [fault.note] if fault.note and fault.intervals_s else []
        )
    slack_s = {
        "spike": SPIKE_ECHO_PERIODS * period_s,
        "other_command": OTHER_COMMAND_S,
    }
    findings = []
    for kind, faulty in sorted(intervals.items()):
        merged = _merge(faulty, slack_s.get(kind, 0.0))
        if merged:
            note = "; ".join(dict.fromkeys(notes[kind]))
            findings.append(QualityFinding(kind, len(merged), tuple(merged), note))
    return tuple(findings)


def _merge(intervals: list[Interval], slack_s: float) -> list[Interval]:
    """Return intervals sorted; equal, overlapping and nearer than slack_s become one interval."""
    merged: list[Interval] = []
    for begin, end in sorted(intervals):
        if merged and (begin < merged[-1][1] + slack_s or (begin, end) == merged[-1]):
            merged[-1] = (merged[-1][0], max(end, merged[-1][1]))
        else:
            merged.append((begin, end))
    return merged
