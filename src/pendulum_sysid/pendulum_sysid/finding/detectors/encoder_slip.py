"""Where the pole's angle steps from one sample to the next, as after a slip of its encoder.

On either side of every instant a cubic is fitted to a few samples; where both, carried on to the
instant, disagree by far more than noise and the motion's own curvature make them, the angle has
stepped (jump points of a curve by one-sided local polynomials; Qiu, Image Processing and Jump
Regression Analysis (2005), chapter 3). Samples that were left out as spikes may
lie in between: a step in fast motion looks like one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pendulum_twin.signals import Floats, Signals

SIDE = 9  # samples on each side
DEGREE = 3
WIDEST = 10  # samples left out between the sides
CLEAR = 5.0  # deviations of noise, and of the disagreement that this motion usually has: chance once in a million
MOST = 4


@dataclass(frozen=True)
class AngleStep:
    """Hold one step: when (s on the clock of the recording, known to half_s) and its size (rad)."""

    time_s: float
    half_s: float
    angle_rad: float


@dataclass(frozen=True)
class _Disagreement:
    """Hold how far both sides disagree at every place (rad), and that in units of what is usual; 0 where not asked."""

    jump: Floats
    clear: Floats


def angle_steps(signals: Signals, noise_rad: float | None) -> tuple[AngleStep, ...]:
    """Return the clearest steps of the pole's angle, at most MOST, the largest first."""
    if signals.pole is None or noise_rad is None or len(signals) < 4 * SIDE:
        return ()
    by_width = [_disagreement(signals, noise_rad, width) for width in range(WIDEST + 1)]
    clock, period = signals.clock_s, signals.period_s
    ranked = sorted(
        (
            (float(one.clear[k]), width, int(k))
            for width, one in enumerate(by_width)
            for k in np.flatnonzero(one.clear > CLEAR)
        ),
        reverse=True,
    )
    found: list[AngleStep] = []
    taken: list[int] = []
    for _, width, k in ranked:
        first = k + SIDE  # left out, or the first sample after the step
        if len(found) < MOST and all(abs(first - other) >= 2 * SIDE for other in taken):
            half = 0.5 * (width + 1) * period
            found.append(
                AngleStep(float(clock[first - 1]) + half, half, float(by_width[width].jump[k]))
            )
        taken.append(first)
    return tuple(found)


def _disagreement(signals: Signals, noise_rad: float, width: int) -> _Disagreement:
    """Return the disagreement across every place where exactly `width` samples between both sides are left out."""
    assert signals.pole is not None
    reach = 2 * SIDE + width
    view = np.lib.stride_tricks.sliding_window_view
    valid = view(signals.pole_valid, reach)
    times = view(signals.clock_s, reach)
    even = (
        np.abs(times[:, -1] - times[:, 0] - (reach - 1) * signals.period_s)
        < 0.5 * signals.period_s
    )
    inside = slice(SIDE, SIDE + width)
    asked = (
        valid[:, :SIDE].all(axis=1)
        & valid[:, SIDE + width :].all(axis=1)
        & ~valid[:, inside].any(axis=1)
        & even
    )
    weights = _towards_the_middle(width)
    angles = view(signals.pole, reach)
    jump = np.where(
        asked, angles[:, SIDE + width :] @ weights - angles[:, :SIDE] @ weights[::-1], 0.0
    )
    usual = noise_rad * float(np.sqrt(2 * np.sum(weights**2)))
    if asked.sum() > reach:  # few places say nothing about the motion's usual disagreement
        usual = max(usual, 1.4826 * float(np.median(np.abs(jump[asked]))))
    return _Disagreement(jump, np.abs(jump) / usual)


def _towards_the_middle(width: int) -> Floats:
    """Return the weights, (SIDE,), that carry samples after a place back to its middle."""
    at = np.arange(SIDE) + 0.5 * (width + 1)
    return np.linalg.pinv(np.vander(at, DEGREE + 1, increasing=True))[0]
