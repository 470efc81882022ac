"""Find where the pole's sensor has come to its end and the pole has not.

A potentiometer or an overflowing counter stays at its last value. At a turning point of the pole,
too, one value comes several times; but the pole comes to it slowly, by steps of its encoder.
"""

from __future__ import annotations

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.clock import find_runs
from pendulum_sysid.cleaning.detector import Fault, Samples, list_spans
from pendulum_sysid.cleaning.jumps import measure_least_step
from pendulum_twin.arrays import Floats


def detect_sensor_end(samples: Samples) -> tuple[Samples, tuple[Fault, ...]]:
    """Leave out the samples at which the pole's sensor stood at its end."""
    pole = samples.positions.get("pole")
    if pole is None or not np.any(np.isfinite(pole)):
        return samples, ()
    runs = find_end_runs(pole)
    if not runs:
        return samples, ()
    inside = np.ones(len(pole), dtype=bool)
    for first, stop in runs:
        inside[first:stop] = False
    note = "the pole's reading stays at its end while the pole moves on, and is left out"
    return samples.pick(inside), (Fault("clipped", list_spans(samples.stamps, runs), note),)


def find_end_runs(values: Floats) -> list[tuple[int, int]]:
    """Return the (first, stop) samples at the largest or smallest value (n,), NaN left out.

    Most of the runs at an end must begin or end at speed; none are returned otherwise.
    """
    floor = measure_least_step(values[np.isfinite(values)])
    end_runs = []
    for end in (np.nanmin(values), np.nanmax(values)):
        runs = [
            (a, b)
            for a, b in find_runs(np.equal(values, end))
            if b - a >= decisions.LIMIT_LEAST_SAMPLES
        ]
        abrupt = sum(_is_abrupt(values, floor, a, b) for a, b in runs)
        if abrupt >= decisions.END_LEAST_RUNS and 2 * abrupt > len(runs):
            end_runs += runs
    return sorted(end_runs)


def _is_abrupt(values: Floats, floor: float, first: int, stop: int) -> bool:
    """Tell whether the sensor moved fast just before the run or just after it."""
    steps = [
        abs(values[a] - values[b])
        for a, b in ((first - 2, first - 3), (stop + 1, stop + 2))
        if min(a, b) >= 0 and max(a, b) < len(values)
    ]
    return bool(steps) and bool(np.nanmax(steps) > floor)
