"""Clean a recording: put it on one clock, mark what the sensors and the recorder got wrong, and say so."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.clipping import find_clipped_runs
from pendulum_sysid.cleaning.clock import (
    Rate,
    estimate_rate,
    fill,
    find_runs,
    hold_commands,
    make_grid,
    resample,
)
from pendulum_sysid.cleaning.frozen import find_frozen_runs
from pendulum_sysid.cleaning.jumps import Places, find_jumps
from pendulum_sysid.cleaning.small_spikes import find_small_spikes
from pendulum_sysid.cleaning.velocity_spikes import find_impossible_rates
from pendulum_sysid.cleaning.wraps import TURN, unwrap
from pendulum_sysid.reading.raw import JOINTS, RawRecording
from pendulum_sysid.records import QualityFinding, Recording
from pendulum_twin.errors import BadInputError
from pendulum_twin.signals import Floats, Mask, Signals

Interval = tuple[float, float]


@dataclass
class _Faults:
    """Collect the intervals (s) of every kind of fault."""

    intervals: dict[str, list[Interval]] = field(default_factory=dict)

    def add(self, kind: str, found: list[Interval]) -> None:
        self.intervals.setdefault(kind, []).extend(found)

    def findings(self, period_s: float) -> tuple[QualityFinding, ...]:
        """Return one finding a kind; faults of several sensors at one time are one."""
        slack = {
            "spike": 1.5 * period_s
        }  # a position's spike echoes in the velocity that was computed from it
        merged = {
            kind: _merged(found, slack.get(kind, 0.0))
            for kind, found in sorted(self.intervals.items())
        }
        return tuple(
            QualityFinding(kind, len(found), tuple(found))
            for kind, found in merged.items()
            if found
        )


@dataclass(frozen=True)
class _Sensor:
    """Hold one joint's good samples: when and what; breaks are the times after which it stays elsewhere."""

    stamps: Floats
    values: Floats
    breaks: Floats


def clean_recording(raw: RawRecording) -> Recording:
    """Return a recording on one uniform clock, with what was found on the way.

    Missing samples and spikes keep their place, filled and marked as not valid. A longer gap, a
    frozen driver or a jump that stays begins a new stretch. Commands are held from message to
    message, 0 before the first. Findings:
    spike: samples out of line in a position or a reported velocity (a velocity invalidates
    nothing).
    gap: samples missing, not finite or lost with the end of the file, commands not finite, and
    jumps that stay.
    jitter: stamps off their grid. wrap: jumps by whole turns, undone. stale: samples that came
    twice, a sensor that stood still while the rig moved, or a beginning that belongs to another
    run. clipped: a command at its limit, which is no fault. count is how many of them there are,
    intervals_s where, in s from the first sample. Raises BadInputError when fewer than 100 samples
    or less than 2 s are left.
    """
    faults = _Faults()
    keep = _usable_rows(raw, faults)
    stamps = raw.state_stamp_s[keep]
    _check_enough(len(stamps), float(np.ptp(stamps)) if len(stamps) else 0.0)
    rate = estimate_rate(stamps)
    _judge_times(raw, stamps, rate, faults)
    positions = {
        joint: _continuous(raw, joint, keep, faults)
        for joint in JOINTS
        if getattr(raw, joint) is not None
    }
    moving = _without_frozen(stamps, positions, faults)
    sensors = {
        joint: _sensor(
            stamps[moving], values[moving], rate, TURN if joint == "pole" else None, faults
        )
        for joint, values in positions.items()
    }
    own = _own_run(stamps, sensors, rate, faults)
    if own > 0.0:
        sensors = {joint: _since(one, own) for joint, one in sensors.items()}
        moving &= stamps >= own
    _judge_velocities(raw, keep, sensors, rate, faults)
    command_stamps, command = _usable_commands(raw, faults)
    signals = _on_one_clock(stamps[moving], sensors, command_stamps, command, rate)
    _check_enough(len(signals), signals.seconds)
    rates = _reported_rates(raw, keep, signals, rate)
    return Recording(raw.name, raw.digest, signals, faults.findings(rate.period_s), rates)


def _reported_rates(raw: RawRecording, keep: Mask, signals: Signals, rate: Rate) -> Floats | None:
    """Return the reported velocities on the signals' clock, (n, 2), NaN where there are none; None for none at all."""
    found = np.full((len(signals), len(JOINTS)), np.nan)
    for k, joint in enumerate(JOINTS):
        values = getattr(raw, f"{joint}_velocity")
        if values is not None and np.isfinite(values[keep]).sum() > 1:
            there = keep & np.isfinite(values)
            column, valid = resample(
                signals.clock_s, raw.state_stamp_s[there], values[there], rate
            )
            found[:, k] = np.where(valid, column, np.nan)
    return found if np.any(np.isfinite(found)) else None


def _check_enough(samples: int, seconds: float) -> None:
    if samples < decisions.LEAST_SAMPLES or seconds < decisions.LEAST_SECONDS:
        raise BadInputError(
            f"expected at least {decisions.LEAST_SAMPLES} usable samples and {decisions.LEAST_SECONDS:g} s, found {samples} samples "
            f"in {seconds:.3g} s: record longer"
        )


def _judge_times(raw: RawRecording, stamps: Floats, rate: Rate, faults: _Faults) -> None:
    end = float(stamps[-1])
    faults.add("gap", _steps(stamps, np.flatnonzero(np.diff(stamps) > rate.gap_s)))
    if raw.lost_messages or raw.cut_short:
        faults.add("gap", [(end, end)])
    if rate.jitter > decisions.JITTER_PERIODS:
        faults.add("jitter", [(0.0, end)])


def _usable_rows(raw: RawRecording, faults: _Faults) -> Mask:
    """Return which samples to use: not one that came twice, nor one without any position."""
    stamps = raw.state_stamp_s
    again = np.concatenate([[False], np.diff(stamps) <= 0])
    faults.add("stale", _spans(stamps, find_runs(again)))
    nothing = np.all(
        [np.isnan(getattr(raw, j)) for j in JOINTS if getattr(raw, j) is not None], axis=0
    )
    return ~again & ~nothing


def _continuous(raw: RawRecording, joint: str, keep: Mask, faults: _Faults) -> Floats:
    """Return a joint's positions in the kept rows, NaN where missing, an angle unwrapped."""
    values = getattr(raw, joint)[keep].copy()
    there = np.isfinite(values)
    stamps = raw.state_stamp_s[keep]
    faults.add("gap", _spans(stamps, find_runs(~there)))
    if joint == "pole" and np.any(there):
        values[there], wraps = unwrap(values[there])
        faults.add("wrap", _steps(stamps[there], wraps))
    return values


def _without_frozen(stamps: Floats, sensors: dict[str, Floats], faults: _Faults) -> Mask:
    moving = np.ones(len(stamps), dtype=bool)
    for first, stop in find_frozen_runs(stamps, list(sensors.values())):
        moving[first:stop] = False
        faults.add("stale", _spans(stamps, [(first, stop)]))
    return moving


def _sensor(
    stamps: Floats, values: Floats, rate: Rate, turn: float | None, faults: _Faults
) -> _Sensor:
    there = np.isfinite(values)
    stamps, values = stamps[there], values[there]
    jumps = find_jumps(stamps, values, rate, turn)
    good = jumps.good.copy()
    if turn is not None:
        values[good], _ = unwrap(values[good])  # a spike may have hidden a turn
    for first, stop in find_small_spikes(stamps, fill(values, good), rate.period_s):
        good[first:stop] = False
    faults.add("spike", _spans(stamps, find_runs(~good)))
    faults.add("gap", _steps(stamps, jumps.stays))
    return _Sensor(stamps[good], values[good], stamps[jumps.stays])


def _own_run(stamps: Floats, sensors: dict[str, _Sensor], rate: Rate, faults: _Faults) -> float:
    """Return when the run begins to which the recording belongs: 0, or after an early jump of cart and pole together.

    No motion takes both elsewhere within a sample: what goes before is left of another run. One of
    them may seem to come
    back: its last samples before the jump are then taken for a spike.
    """
    if len(sensors) < len(JOINTS):
        return 0.0
    breaks = np.concatenate([one.breaks for one in sensors.values()])
    together = [
        t for t in breaks if all(_elsewhere(one, t, rate.period_s) for one in sensors.values())
    ]
    early = [
        t
        for t in together
        if t - stamps[0] <= decisions.OTHER_RUN_SHARE * (stamps[-1] - stamps[0])
    ]
    if not early:
        return 0.0
    last = float(max(early)) + 0.5 * rate.period_s
    faults.add("stale", [(float(stamps[0]), float(max(early)))])
    return last


def _elsewhere(sensor: _Sensor, after_s: float, period_s: float) -> bool:
    """Return whether a sensor jumps after a time, or has no good sample there."""
    jumps = np.any(np.abs(sensor.breaks - after_s) < 1.5 * period_s)
    return bool(jumps) or not np.any(np.abs(sensor.stamps - after_s) < 0.5 * period_s)


def _since(sensor: _Sensor, begin_s: float) -> _Sensor:
    inside = sensor.stamps >= begin_s
    return _Sensor(
        sensor.stamps[inside], sensor.values[inside], sensor.breaks[sensor.breaks >= begin_s]
    )


def _judge_velocities(
    raw: RawRecording, keep: Mask, sensors: dict[str, _Sensor], rate: Rate, faults: _Faults
) -> None:
    for joint, sensor in sensors.items():
        velocity = getattr(raw, f"{joint}_velocity")
        if velocity is None:
            continue
        there = keep & np.isfinite(velocity)
        stamps = raw.state_stamp_s[there]
        bad = find_impossible_rates(
            stamps, velocity[there], sensor.stamps, sensor.values, rate.period_s
        )
        faults.add("spike", _spans(stamps, find_runs(bad)))


def _usable_commands(raw: RawRecording, faults: _Faults) -> tuple[Floats, Floats]:
    """Return the finite commands and when each came."""
    there = np.isfinite(raw.command)
    stamps, command = raw.command_stamp_s[there], raw.command[there]
    faults.add("gap", _spans(raw.command_stamp_s, find_runs(~there)))
    faults.add("clipped", _spans(stamps, find_clipped_runs(command)))
    return stamps, command


def _on_one_clock(
    stamps: Floats,
    sensors: dict[str, _Sensor],
    command_stamps: Floats,
    command: Floats,
    rate: Rate,
) -> Signals:
    """Return all stretches resampled, one after another."""
    stretches = _stretches(stamps, sensors, rate)
    grids = [make_grid(stamps[a:b], rate.period_s) for a, b in stretches]
    instants = np.concatenate([np.empty(0), *grids])
    columns: dict[str, Floats | None] = dict.fromkeys(JOINTS)
    valid = {joint: np.zeros(len(instants), dtype=bool) for joint in JOINTS}
    for joint, sensor in sensors.items():
        parts = [
            _resampled(sensor, stamps[a], stamps[b - 1], on, rate)
            for (a, b), on in zip(stretches, grids, strict=True)
        ]
        columns[joint] = np.concatenate([np.empty(0), *(values for values, _ in parts)])
        valid[joint] = np.concatenate([np.empty(0, dtype=bool), *(good for _, good in parts)])
    _check_enough(len(instants), len(instants) * rate.period_s)
    return Signals(
        period_s=rate.period_s,
        command=hold_commands(instants, rate.period_s, command_stamps, command),
        cart=columns["cart"],
        pole=columns["pole"],
        cart_valid=valid["cart"],
        pole_valid=valid["pole"],
        starts=tuple(int(k) for k in np.cumsum([0, *(len(on) for on in grids[:-1])])),
        begin_s=tuple(float(on[0]) for on in grids),
    )


def _stretches(stamps: Floats, sensors: dict[str, _Sensor], rate: Rate) -> list[tuple[int, int]]:
    """Return (first, stop) samples of the stretches between gaps and jumps that stay, without those too short."""
    breaks = [np.flatnonzero(np.diff(stamps) > rate.break_s) + 1]
    breaks += [np.searchsorted(stamps, sensor.breaks, side="right") for sensor in sensors.values()]
    edges = np.unique(np.concatenate([[0, len(stamps)], *breaks])).astype(int).tolist()
    return [(a, b) for a, b in pairwise(edges) if b - a >= decisions.SHORTEST_STRETCH]


def _resampled(
    sensor: _Sensor, begin: float, end: float, instants: Floats, rate: Rate
) -> tuple[Floats, Mask]:
    inside = (sensor.stamps >= begin) & (sensor.stamps <= end)
    return resample(instants, sensor.stamps[inside], sensor.values[inside], rate)


def _steps(stamps: Floats, places: Places) -> list[Interval]:
    """Return the intervals from the samples at places to those after them."""
    return [(float(stamps[k]), float(stamps[k + 1])) for k in places]


def _spans(stamps: Floats, found: Iterable[tuple[int, int]]) -> list[Interval]:
    """Return the intervals of runs of samples, each (first, stop)."""
    return [(float(stamps[first]), float(stamps[stop - 1])) for first, stop in found]


def _merged(intervals: list[Interval], slack_s: float) -> list[Interval]:
    """Return intervals sorted, those that are the same, overlap or are less than slack_s apart as one."""
    merged: list[Interval] = []
    for begin, end in sorted(intervals):
        if merged and (begin < merged[-1][1] + slack_s or (begin, end) == merged[-1]):
            merged[-1] = (merged[-1][0], max(end, merged[-1][1]))
        else:
            merged.append((begin, end))
    return merged
