"""The noise of a sensor, apart from the bends that steps of the command make in the motion.

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
# Bends are sized beside polynomials that reach this far to either side, s: over shorter times the
# noise that a controller feeds back into its command explains the noise of the position.
SIZED_S = 0.5
SAMPLES_A_SIZE = 30  # of a bend: fewer leave its size to the noise
ROUNDED = 1e-9  # of the range; smaller differences are those of numbers in a file


def measure_noise(values: Floats, valid: Mask, signals: Signals) -> float:
    """Return the standard deviation of a sample's noise, rounding to encoder steps included.

    values: (n,) m or rad, of one sensor of the signals.
    valid: (n,) False where a sample says nothing of the noise.

    What is left is the scatter about the polynomials whose leave-one-out error is the least, as in
    `smoothing.smooth`, or a rounding to the encoder's step, whichever is larger. Bends count as
    noise where samples were interpolated, for these are off there; where samples come so fast that
    no polynomial reaches `SIZED_S`, they count, too, and are small.
    """
    inside = count_to_end(signals.stretches)
    lengths = HALF_LENGTHS if signals.interpolated else HALVES
    halves = list_halves(lengths, valid, signals.stretches)
    bent, spent = _size_bends(values, valid, signals)
    scatters = [
        measure_scatter(compute_residuals(values - bent, half), valid & (inside >= half), half)
        for half in halves
    ]
    best = min(scatters, key=lambda scatter: scatter.left_out)
    count = int(valid.sum())
    kept = np.sqrt(count / (count - spent)) if spent else 1.0
    return max(best.deviation * kept, _measure_rounding(values, valid, signals))


def _size_bends(values: Floats, valid: Mask, signals: Signals) -> tuple[Floats | float, int]:
    """Return the motion (n,) whose bends fit those of values best, and how many sizes it has.

    0 and 0 where no bend is known. A drive answers at once, or a sample late, or two.
    """
    motions = _list_pushed_motions(signals)
    half = max([h for h in HALVES if h * signals.period_s <= SIZED_S], default=0)
    counts = valid & (count_to_end(signals.stretches) >= half)
    reaches = HALVES[-1] * signals.period_s >= SIZED_S
    if not (reaches and half and motions) or counts.sum() < SAMPLES_A_SIZE * len(motions):
        return 0.0, 0
    wanted = compute_residuals(values, half)[counts]
    tries = []
    for late in range(LATEST + 1):
        moved = [_move_later(motion, late) for motion in motions]
        bends = np.array([compute_residuals(motion, half)[counts] for motion in moved])
        scales = np.maximum(np.linalg.norm(bends, axis=1), np.finfo(float).tiny)
        sizes = np.linalg.lstsq((bends / scales[:, None]).T, wanted, rcond=1e-9)[0]
        left = float(np.sum((wanted - (sizes / scales) @ bends) ** 2))
        tries.append((left, np.asarray((sizes / scales) @ np.array(moved))))
    return min(tries, key=lambda tried: tried[0])[1], len(motions)


def _list_pushed_motions(signals: Signals) -> list[Floats]:
    """Return motions (n,) of joints that the command alone pushes, of any size.

    None without a command, and none where samples were interpolated.

    The push of the cart, and its share across the pole: by the angle at each step of the command,
    for the command times the cosine would hold the angle's noise, and explain it.
    """
    command = signals.command - np.mean(signals.command)
    if signals.interpolated or not command.any():
        return []
    pushes = [command]
    if signals.pole is not None:
        steps = np.diff(command, prepend=command[0])
        pushes.append(np.cumsum(steps * np.cos(signals.pole)))
    return [_integrate_twice(push) for push in pushes]


def _integrate_twice(push: Floats) -> Floats:
    """Return where a push (n,), held from sample to sample, takes a free mass, (n,)."""
    speed = np.concatenate([[0.0], np.cumsum(push[:-1])])
    return np.concatenate([[0.0], np.cumsum(speed[:-1] + 0.5 * push[:-1])])


def _move_later(motion: Floats, samples: int) -> Floats:
    """Return a motion (n,) so many samples later."""
    return np.concatenate([np.zeros(samples), motion[: len(motion) - samples]])


def _measure_rounding(values: Floats, valid: Mask, signals: Signals) -> float:
    """Return the deviation of rounding to the smallest step that occurs often among all values.

    values, valid: as of `measure_noise`. The median of the stretches counts: the zeros of two
    recordings may lie apart by a part of a step. Equal readings of several turns differ by the
    rounding of numbers, which is no step.
    """
    steps = [_measure_step(values[s][valid[s]]) for s in signals.stretches if valid[s].any()]
    return float(np.median(steps)) / np.sqrt(12.0) if steps else LEAST_NOISE


def _measure_step(values: Floats) -> float:
    """Return the smallest difference that occurs often among the values (n,) of a stretch."""
    steps = np.diff(np.sort(values))
    steps = steps[steps > ROUNDED * max(float(np.ptp(values)), LEAST_NOISE)]
    if len(steps) < FEWEST_STEPS:
        return LEAST_NOISE
    return float(np.quantile(steps, SMALLEST_STEP_QUANTILE))
