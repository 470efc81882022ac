"""Find stamps that do not follow one another evenly."""

from __future__ import annotations

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.detector import Fault, Samples


def detect_jitter(samples: Samples) -> tuple[Samples, tuple[Fault, ...]]:
    """Say so when the stamps are off their grid by more than a part of a period."""
    if samples.rate.jitter <= decisions.JITTER_PERIODS:
        return samples, ()
    return samples, (Fault("jitter", ((0.0, float(samples.stamps[-1])),)),)
