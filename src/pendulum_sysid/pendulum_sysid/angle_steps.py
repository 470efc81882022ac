"""Where the pole's angle steps from one sample to the next, as after a slip of its encoder.

On either side of every instant a cubic is fitted to a few samples; where both, carried on to the instant, disagree by far
more than noise and the motion's own curvature make them, the angle has stepped (jump points of a curve by one-sided local
polynomials; Qiu, Image Processing and Jump Regression Analysis (2005), chapter 3).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pendulum_twin.signals import Floats, Signals

SIDE = 9  # samples on each side
DEGREE = 3
CLEAR = 8.0  # deviations of noise, and of the disagreement that this motion usually has
MOST = 4
CONTIGUOUS = 1.5  # periods between samples that follow each other


@dataclass(frozen=True)
class AngleStep:
    """Hold one step: the instant in the middle between two samples (s on the clock of the recording) and its size (rad)."""

    time_s: float
    angle_rad: float


def angle_steps(signals: Signals, noise_rad: float | None) -> tuple[AngleStep, ...]:
    """Return the clearest steps of the pole's angle, at most MOST, the largest first."""
    if signals.pole is None or noise_rad is None or len(signals) < 4 * SIDE:
        return ()
    clock = signals.clock_s
    before, after = _towards_the_instant()
    # jump[k]: between samples k + SIDE - 1 and k + SIDE
    windows = np.lib.stride_tricks.sliding_window_view(signals.pole, 2 * SIDE)
    valid = np.lib.stride_tricks.sliding_window_view(signals.pole_valid, 2 * SIDE).all(axis=1)
    times = np.lib.stride_tricks.sliding_window_view(clock, 2 * SIDE)
    even = np.abs(times[:, -1] - times[:, 0] - (2 * SIDE - 1) * signals.period_s) < (CONTIGUOUS - 1) * signals.period_s
    usable = valid & even
    if not np.any(usable):
        return ()
    jump = np.where(usable, windows[:, SIDE:] @ after - windows[:, :SIDE] @ before, 0.0)
    usual = max(
        noise_rad * float(np.sqrt(np.sum(before**2) + np.sum(after**2))),
        1.4826 * float(np.median(np.abs(jump[usable]))),
    )
    found: list[AngleStep] = []
    taken = np.zeros(len(jump), dtype=bool)
    for k in np.argsort(-np.abs(jump)):
        if len(found) == MOST or abs(jump[k]) < CLEAR * usual:
            break
        if not taken[max(k - 2 * SIDE, 0) : k + 2 * SIDE].any():
            found.append(AngleStep(float(clock[k + SIDE]) - 0.5 * signals.period_s, float(jump[k])))
        taken[k] = True
    return tuple(found)


def _towards_the_instant() -> tuple[Floats, Floats]:
    """Return the weights, (SIDE,) each, that carry samples before and after an instant on to it."""
    at = np.arange(SIDE) + 0.5
    weights = np.linalg.pinv(np.vander(at, DEGREE + 1, increasing=True))[0]
    return weights[::-1].copy(), weights
