"""Find what is missing: samples, positions, commands, and messages that the file lost."""

from __future__ import annotations

import numpy as np

from pendulum_sysid.cleaning.clock import find_runs
from pendulum_sysid.cleaning.detector import Fault, Samples, list_spans, list_steps
from pendulum_sysid.reading.raw import RawRecording


def detect_gaps(samples: Samples) -> tuple[Samples, tuple[Fault, ...]]:
    """Say where samples are missing or not finite, and whether the end of the file is lost."""
    raw, stamps = samples.raw, samples.stamps
    gaps = list_steps(stamps, np.flatnonzero(np.diff(stamps) > samples.rate.gap_s))
    for values in samples.positions.values():
        gaps += list_spans(stamps, find_runs(~np.isfinite(values)))
    gaps += list_spans(raw.command_stamp_s, find_runs(~np.isfinite(raw.command)))
    return samples, (Fault("gap", gaps), *_list_lost(raw, float(stamps[-1])))


def _list_lost(raw: RawRecording, end_s: float) -> tuple[Fault, ...]:
    """Return what the file itself is known to have lost; where in it is unknown."""
    damaged = raw.damaged_parts
    lost = [
        (damaged, f"parts of the file that are damaged and left out: {damaged}"),
        (
            raw.lost_messages,
            f"messages that are missing, unreadable or out of order: {raw.lost_messages}",
        ),
        (raw.cut_short, "the file ends before its end mark"),
    ]
    return tuple(Fault("gap", ((end_s, end_s),), note) for there, note in lost if there)
