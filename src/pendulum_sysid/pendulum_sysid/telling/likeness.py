"""Say whether a recording looks like its rig at all, once the twin has been improved."""

from __future__ import annotations

import math

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.fitting.window_runs import WindowRuns
from pendulum_sysid.telling.outcome import Findings, runs_at_noise
from pendulum_sysid.verdict.scores import BeforeAfter
from pendulum_twin.arrays import Floats


def is_unlike(findings: Findings) -> bool:
    """Return whether the recording does not look like the rig that the twin describes.

    The improved twin stays far above its noise floor, and besides follows too little of the
    motion: a precise sensor alone puts a good twin of a real rig tens of floors away. Where
    nothing was found that could stand for the error, the twin has to follow nearly all.
    """
    after, floor = findings.after["held_out"], findings.floor
    if floor is None or not np.isfinite(after.score):
        return True
    followed = compute_followed_share(after)
    far = min(compute_floor_ratio(findings), after.typical / floor.typical)
    if far > decisions.UNLIKE_FLOORS and followed < decisions.UNLIKE_LEAST_FOLLOWED:
        return True
    return is_unexplained(findings) and followed < decisions.UNNAMED_LEAST_FOLLOWED


def is_unexplained(findings: Findings) -> bool:
    """Return whether an error remains, and nothing was found that could stand for it.

    The score is above the noise floor, and the median window shows it, too.
    """
    physics = findings.named or findings.perhaps or findings.certain or findings.laws
    after, floor = findings.after["held_out"], findings.floor
    if physics or floor is None or runs_at_noise(findings):
        return False
    typical = after.typical / floor.typical
    far = compute_floor_ratio(findings) > decisions.LITTLE_MOST_FLOORS
    return bool(far and typical > decisions.FLOORS_AT_NOISE)


def compute_floor_ratio(findings: Findings) -> float:
    """Return the held-out score of the improved twin over that of a perfect model.

    Infinite where a perfect model's cannot be measured.
    """
    floor = findings.floor
    return math.inf if floor is None else findings.after["held_out"].score / floor.score


def compute_floors(findings: Findings) -> BeforeAfter:
    """Return the errors before and after over that of a perfect model: one scale for a verdict.

    Both sides have one measure: the median held-out window. Of a recording that does not look like
    its rig, or whose error nothing explains, all windows together count where that is more. Both
    are 1 at least; infinite where a perfect model's error cannot be measured. What this scale does
    not show, because start states spread in it, `Remainder.whole_windows` does.
    """
    floor, runs = findings.floor, (findings.before["held_out"], findings.after["held_out"])
    if floor is None:
        return BeforeAfter(math.inf, math.inf)
    before, after = (part.typical / floor.typical for part in runs)
    together = tuple(part.score / floor.score for part in runs)
    if (is_unlike(findings) or is_unexplained(findings)) and together[1] > after:
        before, after = together
    return BeforeAfter(max(float(before), 1.0), max(float(after), 1.0))


def compute_followed_share(runs: WindowRuns) -> float:
    """Return how much of the motion the runs follow, 0 to 1, of the channel that they follow less.

    As a fit (NRMSE), but no window counts as worse than standing still: a single run that diverges
    decides nothing.
    """
    errors, motion = runs.squares, compute_motion(runs)
    lost = np.minimum(errors, motion).sum(axis=0)
    return float(np.min(1.0 - np.sqrt(lost / np.maximum(motion.sum(axis=0), 1e-300))))


def compute_fit(runs: WindowRuns) -> Floats:
    """Return the fit of each channel, (channels,): 1 minus the normalised error (NRMSE).

    1 is a perfect run, 0 is no better than the mean of each window; below 0 it is worse. Source:
    Ljung, System Identification, 2nd edition, and MATLAB's `compare`, which takes one mean.
    """
    errors, motion = runs.squares.sum(axis=0), compute_motion(runs).sum(axis=0)
    return np.asarray(1.0 - np.sqrt(errors / np.maximum(motion, 1e-300)))


def compute_motion(runs: WindowRuns) -> Floats:
    """Return the sum of squares of the measured motion about its mean, (windows, channels)."""
    counts = np.maximum(runs.counts.sum(axis=1, keepdims=True), 1.0)
    measured = np.where(runs.counts > 0.0, runs.measured, 0.0)
    away = np.where(runs.counts > 0.0, measured - measured.sum(axis=1, keepdims=True) / counts, 0)
    return np.asarray(np.sum(away**2, axis=1))
