"""The samples and commands of a drive, as they came and on an even grid of times."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pendulum_bridge.doctor.resting import compute_running_median
from pendulum_bridge.doctor.timing import measure_period, number_samples
from pendulum_twin.arrays import Floats

USUAL_CHANGE_QUANTILE = 0.9  # of the changes from sample to sample; spikes are rarer than 10 %
SPIKE_CHANGES = 4  # usual changes; further from the running median is a spike


@dataclass(frozen=True)
class Track:
    """Hold a stretch of driving.

    arrivals: (n,) s.
    samples: (n, 4) in the protocol's order.
    sent_at: (m,) s on the same clock, when each command was sent; it holds until the next.
    sent: (m,) PWM fraction.
    """

    arrivals: Floats
    samples: Floats
    sent_at: Floats
    sent: Floats


@dataclass(frozen=True)
class Grid:
    """Hold samples at even times.

    times: (n,) s.
    samples: (n, 4) without spikes; lost samples are interpolated.
    period_s: between two times.
    """

    times: Floats
    samples: Floats
    period_s: float


def resample(track: Track, expected_s: float) -> Grid:
    """Return a track at even times, the earliest that its arrivals allow.

    track: of at least two samples.
    expected_s: sample period as it should be.
    """
    period_s = measure_period(track.arrivals, expected_s)
    numbers = number_samples(track.arrivals, period_s)
    start = float(np.min(track.arrivals - numbers * period_s))
    even = np.arange(int(numbers[-1]) + 1)
    columns = remove_spikes(track.samples).T
    samples = np.stack([np.interp(even, numbers, column) for column in columns], axis=1)
    return Grid(np.asarray(start + even * period_s), samples, period_s)


def remove_spikes(values: Floats) -> Floats:
    """Return values (n, k) with spikes replaced by the running median of their column.

    Other values stay as they are: in the differences of an encoder that counts slowly the motion
    is single counts, which a median would remove.
    """
    if len(values) < 2:
        return values
    usual = compute_running_median(values)
    far = SPIKE_CHANGES * np.quantile(
        np.abs(np.diff(values, axis=0)), USUAL_CHANGE_QUANTILE, axis=0
    )
    return np.where(np.abs(values - usual) > far, usual, values)


def compute_slopes(values: Floats, period_s: float, half: int = 2) -> Floats:
    """Return the derivative of values (n,) by differences over 2 half samples: (n - 2 half,)."""
    return (values[2 * half :] - values[: -2 * half]) / (2 * half * period_s)
