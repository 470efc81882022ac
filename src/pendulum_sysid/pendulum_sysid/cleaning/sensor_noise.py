"""The noise of a sensor, apart from the kinks that steps of the command make in the motion.

Where samples are far apart the motion bends within the reach of the shortest polynomial, and the
polynomial misses it by more than the noise. A step of the command is known, so the bend is known
up to its size, which least squares gives.
"""

from __future__ import annotations

import numpy as np

from pendulum_sysid.cleaning.smoothing import (
    FEWEST_STEPS,
    HALF_LENGTHS,
    LEAST_NOISE,
    SMALLEST_STEP_QUANTILE,
    compute_residuals,
    count_to_end,
    list_halves,
    measure_scatter,
)
from pendulum_twin.arrays import Floats, Mask
from pendulum_twin.signals import Signals

HALVES = (3, *HALF_LENGTHS)  # a shorter length smooths too little, and misses the motion least
LATEST = 2  # samples; by which a drive may answer late


def measure_noise(values: Floats, valid: Mask, signals: Signals) -> float:
    """Return the standard deviation of a sample's noise, rounding to encoder steps included.

    values: (n,) m or rad, of one sensor of the signals.
    valid: (n,) False where a sample says nothing of the noise.

    What is left is the scatter about the polynomials whose leave-one-out error is the least, as in
    `smoothing.smooth`, or a rounding to the encoder's step, whichever is larger. Samples that were
    interpolated are off where the motion bends: bends count as noise there.
    """
    stretches = signals.stretches
    to_end, pushed = count_to_end(stretches), _list_pushed_motions(signals)
    halves = HALVES if not signals.interpolated else HALF_LENGTHS
    scatters = []
    for half in list_halves(halves, valid, stretches):
        counts = valid & (to_end >= half)
        residuals = compute_residuals(values, half)
        kinks = np.array([compute_residuals(motion, half) for motion in pushed])
        spent = 0
        if counts.sum() > 2 * len(pushed):
            residuals = residuals - _fit_kinks(residuals, kinks, counts)
            spent = len(pushed)
        scatters.append(measure_scatter(residuals, counts, half, spent))
    best = min(scatters, key=lambda scatter: scatter.left_out)
    return max(best.deviation, _measure_rounding(values[valid]))


def _list_pushed_motions(signals: Signals) -> list[Floats]:
    """Return motions (n,) of joints that the command alone pushes, of any size.

    None without a command, and none where samples were interpolated.
    The push of the cart, and its share across the pole; at once, or late, or through a lag.
    """
    command = signals.command - np.mean(signals.command)
    if signals.interpolated or not command.any():
        return []
    pushes = [command]
    if signals.pole is not None:
        pushes.append(command * np.cos(signals.pole))
    motions = []
    for push in pushes:
        speed = np.concatenate([[0.0], np.cumsum(push[:-1])])
        place = np.concatenate([[0.0], np.cumsum(speed[:-1] + 0.5 * push[:-1])])
        late = [np.concatenate([np.zeros(k), place[: len(place) - k]]) for k in range(LATEST + 1)]
        motions += [*late, np.concatenate([[0.0], np.cumsum(place[:-1])])]
    return motions


def _fit_kinks(residuals: Floats, kinks: Floats, counts: Mask) -> Floats:
    """Return what kinks (columns, n) explain of residuals (n,), by least squares, (n,).

    counts: (n,) the samples that count.
    """
    if not len(kinks):
        return np.zeros_like(residuals)
    scales = np.maximum(np.linalg.norm(kinks[:, counts], axis=1), np.finfo(float).tiny)
    scaled = kinks / scales[:, None]
    sizes = np.linalg.lstsq(scaled[:, counts].T, residuals[counts], rcond=1e-9)[0]
    return np.asarray(sizes @ scaled)


def _measure_rounding(values: Floats) -> float:
    """Return the deviation of rounding to the smallest step that occurs often among all values.

    Equal readings of several turns differ by the rounding of numbers, which is no step.
    """
    steps = np.diff(np.sort(values))
    steps = steps[steps > LEAST_NOISE]
    if len(steps) < FEWEST_STEPS:
        return LEAST_NOISE
    return float(np.quantile(steps, SMALLEST_STEP_QUANTILE)) / np.sqrt(12.0)
