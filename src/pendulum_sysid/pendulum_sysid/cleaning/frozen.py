"""Find where a driver kept repeating its last sample while the rig moved on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.clock import find_runs
from pendulum_sysid.cleaning.detector import Fault, Samples, list_spans
from pendulum_sysid.cleaning.jumps import measure_least_step
from pendulum_twin.arrays import Floats

NOTE = "the same values came again while the rig moved on"


def detect_frozen(samples: Samples) -> tuple[Samples, tuple[Fault, ...]]:
    """Leave out the samples that a frozen driver repeated."""
    runs = find_frozen_runs(samples.stamps, list(samples.positions.values()))
    moving = np.ones(len(samples.stamps), dtype=bool)
    for first, stop in runs:
        moving[first:stop] = False
    return samples.pick(moving), (Fault("stale", list_spans(samples.stamps, runs), NOTE),)


def find_frozen_runs(stamps: Floats, sensors: Sequence[Floats]) -> list[tuple[int, int]]:
    """Return (first repeated, stop) samples of every long standstill that no rig makes.

    sensors: (n,) each, unwrapped; NaN counts as a change. All must stand still to the last bit. A
    rig at rest does too; but it comes to rest and starts again gradually, and resumes where it
    stood.
    """
    still = np.all([np.diff(values) == 0 for values in sensors], axis=0)
    floors = [
        decisions.FROZEN_STEP_RATIO * measure_least_step(values[np.isfinite(values)])
        for values in sensors
    ]
    return [
        (first + 1, stop + 1)
        for first, stop in find_runs(still)
        if stamps[stop] - stamps[first] > decisions.FROZEN_LEAST_S
        and any(
            _has_moved_on(values, floor, first, stop)
            for values, floor in zip(sensors, floors, strict=True)
        )
    ]


def _has_moved_on(values: Floats, floor: float, first: int, stop: int) -> bool:
    """Tell whether a sensor shows that the rig moved while it stood still (first to stop)."""
    near = decisions.FROZEN_NEAR_STEPS + 1
    if first < near or stop + near >= len(values):
        return False
    before = np.abs(np.diff(values[first - near : first + 1]))
    after = np.abs(np.diff(values[stop : stop + near + 1]))
    stopped, resumed = float(before[-1]), float(after[0])
    speed = max(float(np.median(before[:-1])), float(np.median(after[1:])))
    elsewhere = (
        resumed > floor + 2 * after[1:].max() and max(before.sum(), after[1:].sum()) > floor
    )
    abrupt = min(stopped, resumed) > max(decisions.FROZEN_SPEED_SHARE * speed, floor)
    return bool(elsewhere or abrupt)
