"""Find samples that came twice: the stamp of a sample must be later than the one before."""

from __future__ import annotations

import numpy as np

from pendulum_sysid.cleaning.clock import find_runs
from pendulum_sysid.cleaning.detector import Fault, list_spans
from pendulum_sysid.reading.raw import RawRecording
from pendulum_twin.arrays import Mask


def find_usable_rows(raw: RawRecording) -> tuple[Mask, tuple[Fault, ...]]:
    """Return which samples to use, (n,): none that came twice, none without any position."""
    stamps = raw.state_stamp_s
    again = np.concatenate([[False], np.diff(stamps) <= 0])
    nothing = np.all([np.isnan(values) for values in raw.positions.values()], axis=0)
    return ~again & ~nothing, (Fault("stale", list_spans(stamps, find_runs(again))),)
