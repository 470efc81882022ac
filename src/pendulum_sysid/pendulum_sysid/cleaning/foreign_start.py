"""Find a beginning that is left of another run: cart and pole jump at once.

No motion takes both elsewhere within a sample. One of them may seem to come back: its last samples
before the jump are then taken for a spike.
"""

from __future__ import annotations

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.detector import Fault, Samples

NOTE = "cart and pole jump at once: what goes before is left of another run"


def detect_foreign_start(samples: Samples) -> tuple[Samples, tuple[Fault, ...]]:
    """Leave out what goes before the last early jump of cart and pole together."""
    tracks = [samples.get_track(joint) for joint in samples.positions]
    if len(tracks) < 2:
        return samples, ()
    stamps, period_s = samples.stamps, samples.rate.period_s
    latest_s = stamps[0] + decisions.OTHER_RUN_SHARE * (stamps[-1] - stamps[0])
    jumps = [
        float(time_s)
        for time_s in np.concatenate([track.breaks for track in tracks])
        if time_s <= latest_s and all(track.is_absent_after(time_s, period_s) for track in tracks)
    ]
    if not jumps:
        return samples, ()
    own = stamps >= max(jumps) + 0.5 * period_s
    return samples.pick(own), (Fault("stale", ((float(stamps[0]), max(jumps)),), NOTE),)
