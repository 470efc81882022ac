"""Find what is missing: samples, positions, commands, and messages that the file lost."""

from __future__ import annotations

import numpy as np

from pendulum_sysid.cleaning.clock import find_runs
from pendulum_sysid.cleaning.detector import Fault, Samples, list_spans, list_steps


def detect_gaps(samples: Samples) -> tuple[Samples, tuple[Fault, ...]]:
    """Say where samples are missing or not finite, and whether the end of the file is lost."""
    raw, stamps = samples.raw, samples.stamps
    gaps = list_steps(stamps, np.flatnonzero(np.diff(stamps) > samples.rate.gap_s))
    for values in samples.positions.values():
        gaps += list_spans(stamps, find_runs(~np.isfinite(values)))
    gaps += list_spans(raw.command_stamp_s, find_runs(~np.isfinite(raw.command)))
    if raw.lost_messages or raw.cut_short:
        gaps += ((float(stamps[-1]), float(stamps[-1])),)
    return samples, (Fault("gap", gaps),)
