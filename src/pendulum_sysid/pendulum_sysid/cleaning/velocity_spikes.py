"""Find reported velocities that the positions around them rule out."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import maximum_filter1d

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.clock import find_runs
from pendulum_sysid.cleaning.detector import Fault, Samples, list_spans
from pendulum_sysid.cleaning.jumps import measure_step_floor
from pendulum_twin.arrays import Floats, Mask


def detect_velocity_spikes(samples: Samples) -> tuple[Samples, tuple[Fault, ...]]:
    """Say which reported velocities are out of line; no position is invalidated by them."""
    faults = []
    for joint in samples.positions:
        velocity = samples.raw.get_velocity(joint)
        if velocity is None:
            continue
        there = samples.rows & np.isfinite(velocity)
        stamps, track = samples.raw.state_stamp_s[there], samples.get_track(joint)
        bad = find_impossible_rates(
            stamps, velocity[there], track.stamps, track.values, samples.rate.period_s
        )
        faults.append(Fault("spike", list_spans(stamps, find_runs(bad))))
    return samples, tuple(faults)


def find_impossible_rates(
    instants: Floats, rates: Floats, stamps: Floats, values: Floats, period_s: float
) -> Mask:
    """Return which reported velocities, (n,), are far above what the positions did nearby.

    stamps, values: good positions, (m,) in m or rad. A filtered velocity lags, but it does not go
    beyond.
    """
    if len(values) < 2:
        return np.zeros(len(rates), dtype=bool)
    moved = maximum_filter1d(
        np.abs(np.diff(values)) / np.diff(stamps), 2 * decisions.SPIKE_SIDE_STEPS + 1
    )
    nearby = moved[np.clip(np.searchsorted(stamps, instants) - 1, 0, len(moved) - 1)]
    return (
        np.abs(rates) > decisions.VELOCITY_RATIO * nearby + measure_step_floor(values) / period_s
    )
