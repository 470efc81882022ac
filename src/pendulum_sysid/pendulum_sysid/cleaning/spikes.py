"""Find positions out of line with the motion: spikes, which return, and jumps, which stay."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pendulum_sysid.cleaning.clock import Rate, fill, find_runs
from pendulum_sysid.cleaning.detector import Fault, Samples, Track, list_spans, list_steps
from pendulum_sysid.cleaning.jumps import find_jumps
from pendulum_sysid.cleaning.small_spikes import find_small_spikes
from pendulum_sysid.cleaning.wraps import TURN, unwrap
from pendulum_twin.arrays import Floats


def detect_spikes(samples: Samples) -> tuple[Samples, tuple[Fault, ...]]:
    """Take the spikes out of every joint, and break it where it stays elsewhere."""
    positions, breaks, faults = {}, {}, []
    for joint in samples.positions:
        track, turn = samples.get_track(joint), TURN if joint == "pole" else None
        values, breaks[joint], joint_faults = _judge(track, samples.rate, turn)
        positions[joint] = samples.positions[joint].copy()
        positions[joint][np.isfinite(positions[joint])] = values
        faults += joint_faults
    return replace(samples, positions=positions, breaks=breaks), tuple(faults)


def _judge(track: Track, rate: Rate, turn: float | None) -> tuple[Floats, Floats, list[Fault]]:
    """Return the track's values (m,), NaN at spikes, its breaks (s), and the faults."""
    stamps, values = track.stamps, track.values
    jumps = find_jumps(stamps, values, rate, turn)
    good = jumps.good.copy()
    if turn is not None:
        values[good], _ = unwrap(values[good])  # a spike may have hidden a turn
    for first, stop in find_small_spikes(stamps, fill(values, good), rate.period_s):
        good[first:stop] = False
    spikes = Fault("spike", list_spans(stamps, find_runs(~good)))
    jumps_that_stay = Fault("gap", list_steps(stamps, jumps.stays))
    return np.where(good, values, np.nan), stamps[jumps.stays], [spikes, jumps_that_stay]
