"""The protocol of the detectors: each takes samples, marks what is wrong, and says where.

A detector is a function of a file of its own; `clean.DETECTORS` is their sequence.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace

import numpy as np

from pendulum_sysid.cleaning.clock import Rate
from pendulum_sysid.cleaning.jumps import Places
from pendulum_sysid.reading.raw import RawRecording
from pendulum_sysid.records import FaultKind
from pendulum_twin.arrays import Floats, Mask

Interval = tuple[float, float]


@dataclass(frozen=True)
class Fault:
    """Say what is wrong with samples.

    kind: spike | gap | jitter | wrap | stale | clipped | other_command.
    intervals_s: begin and end of each fault, s from the first sample.
    note: what the kind alone does not say, in words; empty for nothing.
    """

    kind: FaultKind
    intervals_s: tuple[Interval, ...]
    note: str = ""


@dataclass(frozen=True)
class Track:
    """Hold the good samples of one joint.

    stamps: (m,) s from the first sample.
    values: (m,) m or rad.
    breaks: s, the stamps after which the joint stays elsewhere.
    """

    stamps: Floats
    values: Floats
    breaks: Floats

    def is_absent_after(self, time_s: float, period_s: float) -> bool:
        """Tell whether the joint jumps after a stamp, or has no good sample there."""
        jumps = bool(np.any(np.abs(self.breaks - time_s) < 1.5 * period_s))
        return jumps or not np.any(np.abs(self.stamps - time_s) < 0.5 * period_s)


@dataclass(frozen=True)
class Samples:
    """Hold a recording on its way through the detectors.

    raw: as recorded.
    rows: (raw samples,) False where a sample of the recording is not used at all.
    rate: period and jitter of the stamps.
    stamps: (n,) s from the first sample.
    positions: joint -> (n,) m or rad, NaN where there is no good sample.
    breaks: joint -> s, the stamps after which the joint stays elsewhere.
    """

    raw: RawRecording
    rows: Mask
    rate: Rate
    stamps: Floats
    positions: dict[str, Floats]
    breaks: dict[str, Floats] = field(default_factory=dict)

    def get_track(self, joint: str) -> Track:
        """Return the good samples of a joint."""
        good = np.isfinite(self.positions[joint])
        breaks = self.breaks.get(joint, np.empty(0))
        return Track(self.stamps[good], self.positions[joint][good], breaks)

    def pick(self, chosen: Mask) -> Samples:
        """Return the chosen samples (n,) alone, without breaks before the first of them."""
        stamps = self.stamps[chosen]
        begin_s = stamps[0] if len(stamps) else np.inf
        return replace(
            self,
            stamps=stamps,
            positions={joint: values[chosen] for joint, values in self.positions.items()},
            breaks={joint: times[times >= begin_s] for joint, times in self.breaks.items()},
        )


Detector = Callable[[Samples], tuple[Samples, tuple[Fault, ...]]]


def list_steps(stamps: Floats, places: Places) -> tuple[Interval, ...]:
    """Return the intervals from the samples at places to those after them."""
    return tuple((float(stamps[k]), float(stamps[k + 1])) for k in places)


def list_spans(stamps: Floats, runs: Iterable[tuple[int, int]]) -> tuple[Interval, ...]:
    """Return the intervals of runs of samples, each (first, stop)."""
    return tuple((float(stamps[first]), float(stamps[stop - 1])) for first, stop in runs)
