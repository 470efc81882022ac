"""Leave stretches of samples out of a recording."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pendulum_sysid.records import QualityFinding, Recording


def leave_samples_out(
    recording: Recording, spans: Sequence[tuple[int, int]], finding: QualityFinding
) -> Recording:
    """Mark spans of samples (first, stop) as not valid, begin stretches there, add the finding."""
    signals = recording.signals
    valid = np.ones(len(signals), dtype=bool)
    for first, stop in spans:
        valid[first:stop] = False
    cleaned = replace(
        signals, cart_valid=signals.cart_valid & valid, pole_valid=signals.pole_valid & valid
    ).break_at(k for span in spans for k in span if 0 < k < len(signals))
    return replace(recording, signals=cleaned, findings=(*recording.findings, finding))
