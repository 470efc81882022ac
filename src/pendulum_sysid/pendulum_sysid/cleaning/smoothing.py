"""Values, rates and accelerations smoothed out of a sampled signal by local polynomials.

Savitzky and Golay, Analytical Chemistry 36 (1964) 1627; the length is chosen by leave-one-out
cross-validation, which for a linear smoother needs no refits (Craven and Wahba, Numerische
Mathematik 31 (1979), lemma 3.2).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import savgol_coeffs, savgol_filter

from pendulum_twin.arrays import Floats, Mask

ORDER = 5
HALF_LENGTHS = (4, 5, 6, 8, 10, 13, 16, 20, 26, 32, 40, 52, 64, 80)


@dataclass(frozen=True)
class Smooth:
    """Hold a signal's smoothed value and rate (1/s), each (n,).

    noise: standard deviation of one sample; scatter: what of it the polynomials show. value_noise,
    rate_noise: what is left of it in value and rate. half_length: samples to either side that each
    polynomial spans.
    """

    value: Floats
    rate: Floats
    noise: float
    scatter: float
    value_noise: float
    rate_noise: float
    half_length: int


def smooth(values: Floats, valid: Mask, stretches: tuple[slice, ...], period_s: float) -> Smooth:
    """Return values (n,) smoothed within each stretch; samples that are not valid hold placeholders and count less.

    The noise is what a local polynomial leaves, or a uniform rounding to the encoder's step,
    whichever is larger.
    """
    longest = max(s.stop - s.start for s in stretches)
    usable = [h for h in HALF_LENGTHS if 2 * h + 1 <= longest] or [4]
    errors = {h: _left_out_error(values, valid, stretches, h) for h in usable}
    half = min(errors, key=lambda h: errors[h][0])
    value, rate = (derivative(values, stretches, period_s, half, d) for d in (0, 1))
    noise = max(errors[half][1], _rounding(values, valid))
    gains = [noise_gain(half, period_s, d) for d in (0, 1)]
    return Smooth(value, rate, noise, errors[half][1], noise * gains[0], noise * gains[1], half)


def noise_gain(half: int, period_s: float, order: int) -> float:
    """Return how much of a sample's deviation is left in a derivative of an order (0 to 2) by such polynomials."""
    return float(np.linalg.norm(savgol_coeffs(2 * half + 1, ORDER, deriv=order, delta=period_s)))


def derivative(
    values: Floats, stretches: tuple[slice, ...], period_s: float, half: int, order: int
) -> Floats:
    """Return the derivative of an order (0 to 2) of values (n,), by polynomials that span half a length to either side."""
    found = np.empty_like(values)
    for stretch in stretches:
        part = values[stretch]
        length = min(2 * half + 1, (len(part) - 1) // 2 * 2 + 1)
        degree = min(ORDER, length - 1)
        short = order > degree
        found[stretch] = (
            0.0
            if short
            else savgol_filter(part, length, degree, deriv=order, delta=period_s, mode="interp")
        )
    return found


def _left_out_error(
    values: Floats, valid: Mask, stretches: tuple[slice, ...], half: int
) -> tuple[float, float]:
    """Return the mean squared leave-one-out error, and the noise's deviation that the residuals show."""
    length = 2 * half + 1
    own = savgol_coeffs(length, ORDER)[half]
    residuals = []
    for stretch in stretches:
        part = values[stretch]
        if len(part) <= length:
            continue
        off = (part - savgol_filter(part, length, ORDER))[half:-half]
        residuals.append(off[valid[stretch][half:-half]])
    left = np.concatenate(residuals) if residuals else np.zeros(1)
    power = float(np.mean(left**2)) if len(left) else 0.0
    return power / (1 - own) ** 2, float(np.sqrt(power / (1 - own)))


def _rounding(values: Floats, valid: Mask) -> float:
    """Return the deviation of rounding to the smallest step between neighbours that occurs often.

    Where a joint never rests, its own motion makes the smallest steps: the noise is then
    overestimated, which is the side
    on which a start state may be: smoothing rounds the kinks of a motion by more than noise does.
    """
    both = valid[1:] & valid[:-1]
    steps = np.abs(np.diff(values))[both]
    steps = steps[steps > 0]
    if len(steps) < 10:
        return 1e-12
    return float(np.quantile(steps, 0.01)) / np.sqrt(12.0)
