"""The noise of a sensor, apart from the bends that steps of the command make in the motion.

Where samples are far apart the motion bends within the reach of the shortest polynomial, and the
polynomial misses it by more than the noise. A step of the command is known, so the bend is known
up to its size, which least squares gives.
"""

from __future__ import annotations

from collections.abc import Sequence

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
# To either side of the polynomials beside which bends are sized: over shorter times the noise that
# a controller feeds back into its command would count as a bend.
SIZED_S = 0.16


def measure_noise(values: Floats, valid: Mask, signals: Signals) -> float:
    """Return the standard deviation of a sample's noise, rounding to encoder steps included.

    values: (n,) m or rad, of one sensor of the signals.
    valid: (n,) False where a sample says nothing of the noise.

    What is left is the scatter about the polynomials whose leave-one-out error is the least, as in
    `smoothing.smooth`, or a rounding to the encoder's step, whichever is larger. Samples that were
    interpolated are off where the motion bends: bends count as noise there.
    """
    inside = count_to_end(signals.stretches)
    lengths = HALF_LENGTHS if signals.interpolated else HALVES
    halves = list_halves(lengths, valid, signals.stretches)
    straight = values - _size_bends(values, valid, signals, halves)
    scatters = [
        measure_scatter(compute_residuals(straight, half), valid & (inside >= half), half)
        for half in halves
    ]
    best = min(scatters, key=lambda scatter: scatter.left_out)
    return max(best.deviation, _measure_rounding(values[valid]))


def _size_bends(
    values: Floats, valid: Mask, signals: Signals, halves: Sequence[int]
) -> Floats | float:
    """Return the motion (n,) whose bends fit those of values best; 0 where no bend is known.

    halves: lengths of polynomials that the stretches hold.
    """
    motions = _list_pushed_motions(signals)
    half = max([h for h in halves if h * signals.period_s <= SIZED_S], default=halves[0])
    counts = valid & (count_to_end(signals.stretches) >= half)
    if not motions or counts.sum() <= 2 * len(motions):
        return 0.0
    bends = np.array([compute_residuals(motion, half)[counts] for motion in motions])
    scales = np.maximum(np.linalg.norm(bends, axis=1), np.finfo(float).tiny)
    wanted = compute_residuals(values, half)[counts]
    sizes = np.linalg.lstsq((bends / scales[:, None]).T, wanted, rcond=1e-9)[0]
    return np.asarray((sizes / scales) @ np.array(motions))


def _list_pushed_motions(signals: Signals) -> list[Floats]:
    """Return motions (n,) of joints that the command alone pushes, of any size.

    None without a command, and none where samples were interpolated.
    The push of the cart, and its share across the pole; at once, or late, or through a lag. The
    share is that of the angle at each step of the command: the command times the cosine would hold
    the angle's noise, and explain it.
    """
    command = signals.command - np.mean(signals.command)
    if signals.interpolated or not command.any():
        return []
    pushes = [command]
    if signals.pole is not None:
        steps = np.diff(command, prepend=command[0])
        pushes.append(np.cumsum(steps * np.cos(signals.pole)))
    motions = []
    for push in pushes:
        speed = np.concatenate([[0.0], np.cumsum(push[:-1])])
        place = np.concatenate([[0.0], np.cumsum(speed[:-1] + 0.5 * push[:-1])])
        late = [np.concatenate([np.zeros(k), place[: len(place) - k]]) for k in range(LATEST + 1)]
        motions += [*late, np.concatenate([[0.0], np.cumsum(place[:-1])])]
    return motions


def _measure_rounding(values: Floats) -> float:
    """Return the deviation of rounding to the smallest step that occurs often among all values.

    Equal readings of several turns differ by the rounding of numbers, which is no step.
    """
    steps = np.diff(np.sort(values))
    steps = steps[steps > LEAST_NOISE]
    if len(steps) < FEWEST_STEPS:
        return LEAST_NOISE
    return float(np.quantile(steps, SMALLEST_STEP_QUANTILE)) / np.sqrt(12.0)
