"""Whether the stamps of the samples are right, or their order: the smoother motion decides.

A driver that samples evenly may stamp unevenly (a busy computer, stamps of the arrival). Each
sample then stands at a wrong time, by as much as the rig moves within the error. A rig that is
sampled unevenly and stamped rightly is the opposite case, and looks alike to the clock. However
near the clock its samples are, each was taken at its stamp: the motion decides there, too.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.detector import Fault
from pendulum_sysid.cleaning.even_clock import EvenClock, find_even_clock
from pendulum_sysid.cleaning.paused_clock import find_paused_clock
from pendulum_sysid.cleaning.received_clock import place_clock
from pendulum_sysid.cleaning.wraps import TURN
from pendulum_sysid.reading.raw import RawRecording
from pendulum_twin.arrays import Floats, Mask

FEWEST_OFF = 20  # samples off the even clock; fewer decide nothing
CLOCK_EXACT = 0.001  # periods; stamps no further off stand on the even clock
TRIMMED = 0.05  # of samples; spikes and wraps decide nothing


@dataclass(frozen=True)
class Retimed:
    """Hold a recording whose samples stand at their times.

    raw: the recording.
    rows: (samples,) False where a sample cannot be used.
    spread_s: by how much the time between samples and commands is unknown; 0 for right stamps.
    placed: whether samples stand where the soonest of them are received at once.
    faults: what was wrong with the stamps.
    uneven: whether samples were taken as unevenly as their stamps say.
    """

    raw: RawRecording
    rows: Mask
    spread_s: float = 0.0
    placed: bool = False
    faults: tuple[Fault, ...] = ()
    uneven: bool = False


def retime_samples(raw: RawRecording, rows: Mask) -> Retimed:
    """Put samples on an even clock where that makes the motion smoother than their stamps do.

    rows: (samples,) False where a sample is not used.
    """
    stamps = raw.state_stamp_s[rows]
    clock, sure = find_even_clock(stamps), np.ones(len(stamps), dtype=bool)
    if clock is None:
        paused = find_paused_clock(stamps)
        if paused is None:
            return Retimed(raw, _drop_equal_stamps(raw, rows), uneven=True)
        clock, sure = paused
    positions = {joint: values[rows] for joint, values in raw.positions.items()}
    differ = np.abs(clock.off_s) > 2 * decisions.CLOCK_ALIGNED * clock.period_s
    received = raw.state_received_s
    placed = None if received is None else place_clock(clock, received[rows])
    if np.sum(differ) < FEWEST_OFF:
        uneven = placed is None and _are_stamps_smoother(stamps, clock, positions)
        kept = _drop_equal_stamps(raw, rows)
        return Retimed(raw, kept, placed=placed is not None, uneven=uneven)
    as_stamped = _measure_roughness(stamps, positions, differ)
    even = _measure_roughness(clock.times_s, positions, differ)
    if not even < decisions.EVEN_ROUGHNESS_RATIO * as_stamped:
        return Retimed(raw, _drop_equal_stamps(raw, rows), uneven=True)
    faults, spread_s = _list_faults(clock), clock.spread_s
    if placed is not None:
        clock, sure = placed[0], sure & placed[1]
    kept = rows.copy()
    kept[rows] = sure
    retimed = _set_stamps(raw, rows, clock)
    return Retimed(retimed, kept, spread_s, placed is not None, faults)


def _are_stamps_smoother(stamps: Floats, clock: EvenClock, positions: dict[str, Floats]) -> bool:
    """Return whether the motion is smoother by stamps (n,) that lie near the even clock."""
    differ = np.abs(clock.off_s) > CLOCK_EXACT * clock.period_s
    if np.sum(differ) < FEWEST_OFF:
        return False
    as_stamped = _measure_roughness(stamps, positions, differ)
    even = _measure_roughness(clock.times_s, positions, differ)
    return as_stamped < decisions.EVEN_ROUGHNESS_RATIO * even


def _list_faults(clock: EvenClock) -> tuple[Fault, ...]:
    deviation = float(np.std(clock.off_s))
    if deviation <= decisions.JITTER_PERIODS * clock.period_s:
        return ()
    note = (
        f"stamps are off an even clock by {1e3 * deviation:.2g} ms; samples were taken evenly and "
        "stand in their order"
    )
    return (Fault("jitter", ((0.0, float(clock.times_s[-1])),), note),)


def _set_stamps(raw: RawRecording, rows: Mask, clock: EvenClock) -> RawRecording:
    """Return the recording with its used rows on the clock, and the others between them."""
    places = np.interp(np.arange(len(rows)), np.flatnonzero(rows), clock.times_s)
    return replace(raw, state_stamp_s=places)


def _drop_equal_stamps(raw: RawRecording, rows: Mask) -> Mask:
    """Return the rows without those whose stamp is that of the used row before."""
    used = np.flatnonzero(rows)
    again = np.concatenate([[False], np.diff(raw.state_stamp_s[used]) <= 0])
    kept = rows.copy()
    kept[used[again]] = False
    return kept


def _measure_roughness(stamps: Floats, positions: dict[str, Floats], differ: Mask) -> float:
    """Return the error of the samples' predictions from their neighbours, joints multiplied.

    differ: (samples,) the samples whose times are in question; the others say nothing.
    """
    return float(
        np.prod([_predict_error(stamps, v, joint, differ) for joint, v in positions.items()])
    )


def _predict_error(stamps: Floats, values: Floats, joint: str, differ: Mask) -> float:
    """Return the root mean square error of a cubic through two samples on either side."""
    good = np.isfinite(values)
    stamps, values, differ = stamps[good], values[good], differ[good]
    if joint == "pole":
        values = np.unwrap(values, period=TURN)
    at = [stamps[k : len(stamps) - 4 + k] for k in range(5)]
    sides, error = (0, 1, 3, 4), values[2:-2].copy()
    with np.errstate(divide="ignore", invalid="ignore"):
        for k in sides:
            weight = np.prod([(at[2] - at[j]) / (at[k] - at[j]) for j in sides if j != k], axis=0)
            error -= weight * values[k : len(values) - 4 + k]
    squares = np.sort(np.nan_to_num(error[differ[2:-2]] ** 2, nan=np.inf, posinf=np.inf))
    kept = squares[: int((1.0 - TRIMMED) * len(squares))]
    return float(np.sqrt(np.mean(kept))) if len(kept) else np.inf
