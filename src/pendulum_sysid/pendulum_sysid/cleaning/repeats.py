"""Find samples that came twice: the same stamp and the same values as the sample before."""

from __future__ import annotations

import numpy as np

from pendulum_sysid.cleaning.clock import find_runs
from pendulum_sysid.cleaning.detector import Fault, list_spans
from pendulum_sysid.reading.raw import RawRecording
from pendulum_twin.arrays import Mask

NOTE = "samples came twice"


def find_usable_rows(raw: RawRecording) -> tuple[Mask, tuple[Fault, ...]]:
    """Return which samples to use, (n,): none that came twice, none without any position.

    Samples of one stamp and other values came in a burst and stay.
    """
    stamps, positions = raw.state_stamp_s, list(raw.positions.values())
    alike = np.all([_is_like_before(values) for values in positions], axis=0)
    again = np.concatenate([[False], np.diff(stamps) <= 0]) & alike
    nothing = np.all([np.isnan(values) for values in positions], axis=0)
    return ~again & ~nothing, (Fault("stale", list_spans(stamps, find_runs(again)), NOTE),)


def _is_like_before(values: np.ndarray) -> Mask:
    """Return where a value is that of the sample before, or there is none, (n,)."""
    before = np.concatenate([[np.nan], values[:-1]])
    return (values == before) | np.isnan(values)
