"""Values, rates and accelerations smoothed out of a sampled signal by local polynomials.

Savitzky and Golay, Analytical Chemistry 36 (1964) 1627; the length is chosen by leave-one-out
cross-validation, which for a linear smoother needs no refits (Craven and Wahba, Numerische
Mathematik 31 (1979), lemma 3.2). The weights are those of `scipy.signal.savgol_filter`, which fits
the ends of every stretch anew; here all stretches share one matrix of weights.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.polynomial.polynomial import polyder, polyvander
from scipy.ndimage import correlate1d

from pendulum_twin.arrays import Floats, Mask

DEGREE = 5
HALF_LENGTHS = (4, 5, 6, 8, 10, 13, 16, 20, 26, 32, 40, 52, 64, 80)
FEWEST_STEPS = 10  # steps between samples that say something of the rounding
SMALLEST_STEP_QUANTILE = 0.01  # of the steps: smaller ones are chance
LEAST_NOISE = 1e-12  # m, rad: where the signal never moves


@dataclass(frozen=True)
class Smooth:
    """Hold a smoothed signal of n samples.

    value: (n,) in the signal's unit.
    rate: (n,) in the signal's unit per s.
    noise: standard deviation of one sample's noise, rounding to encoder steps included.
    value_noise, rate_noise: standard deviation that the noise leaves in value and rate.
    half_length: samples to either side that each polynomial spans.
    """

    value: Floats
    rate: Floats
    noise: float
    value_noise: float
    rate_noise: float
    half_length: int


def smooth(values: Floats, valid: Mask, stretches: tuple[slice, ...], period_s: float) -> Smooth:
    """Smooth a signal within each stretch.

    values: (n,) m or rad; samples that are not valid hold placeholders.
    valid: (n,) False where a sample says nothing of the noise.
    stretches: of the samples; together they cover all of them.

    The noise is the scatter about the polynomials or that of a rounding to the encoder's step,
    whichever is larger.
    """
    lengths = [stretch.stop - stretch.start for stretch in stretches]
    to_end = np.concatenate([np.minimum(np.arange(n), np.arange(n)[::-1]) for n in lengths])
    counting = [n for n, s in zip(lengths, stretches, strict=True) if valid[s].any()] or lengths
    halves = [h for h in HALF_LENGTHS if 2 * h + 1 <= max(counting)] or [HALF_LENGTHS[0]]
    errors = {h: _measure_left_out_error(values, valid & (to_end >= h), h) for h in halves}
    half = min(errors, key=lambda h: errors[h][0])
    scatter = errors[half][1]
    value, rate = (differentiate(values, stretches, period_s, half, d) for d in (0, 1))
    noise = max(scatter, _measure_rounding(values, valid))
    gains = [compute_noise_gain(half, period_s, d) for d in (0, 1)]
    return Smooth(value, rate, noise, noise * gains[0], noise * gains[1], half)


def compute_noise_gain(half: int, period_s: float, order: int) -> float:
    """Return the part of a sample's deviation that is left in a derivative of an order (0 to 2).

    half: samples to either side that each polynomial spans.
    """
    return float(np.linalg.norm(_fit_weights(2 * half + 1, order)[half])) / period_s**order


def differentiate(
    values: Floats, stretches: tuple[slice, ...], period_s: float, half: int, order: int
) -> Floats:
    """Return the derivative of an order (0 to 2) of values (n,), (n,) per s^order.

    half: samples to either side that each polynomial spans. Samples nearer to an end of their
        stretch take the polynomial at that end; a shorter stretch is spanned as a whole.
    """
    length = 2 * half + 1
    result: Floats = correlate1d(values, _fit_weights(length, order)[half], mode="nearest")
    begins = np.array([stretch.start for stretch in stretches])
    ends = np.array([stretch.stop for stretch in stretches])
    spans = np.minimum(length, (ends - begins - 1) // 2 * 2 + 1)
    for span in np.unique(spans):
        weights, middle = _fit_weights(int(span), order), int(span) // 2
        first = begins[spans == span, None] + np.arange(span)
        last = ends[spans == span, None] - span + np.arange(span)
        result[first[:, : middle + 1]] = values[first] @ weights[: middle + 1].T
        result[last[:, middle:]] = values[last] @ weights[middle:].T
    return result / period_s**order


@lru_cache(maxsize=64)
def _fit_weights(length: int, order: int) -> Floats:
    """Return the weights, (length, length), by which a polynomial is fitted to samples.

    Row k times the samples is the derivative, per sample period^order, at sample k.
    """
    degree, reach = min(DEGREE, length - 1), max(length // 2, 1)
    if order > degree:
        return np.zeros((length, length))
    places = (np.arange(length) - length // 2) / reach
    slopes = polyvander(places, degree - order) @ polyder(np.eye(degree + 1), order)
    return slopes @ np.linalg.pinv(polyvander(places, degree)) / float(reach) ** order


def _measure_left_out_error(values: Floats, counts: Mask, half: int) -> tuple[float, float]:
    """Return the mean squared leave-one-out error, and the noise's deviation by the residuals.

    counts: (n,) True where a sample counts and lies so far inside its stretch.

    The error is infinite where fewer samples count than a polynomial spans: they tell nothing.
    """
    weights = _fit_weights(2 * half + 1, 0)[half]
    residuals = (values - correlate1d(values, weights, mode="nearest"))[counts]
    if len(residuals) < len(weights):
        return np.inf, 0.0
    power, own = float(np.mean(residuals**2)), weights[half]
    return power / (1 - own) ** 2, float(np.sqrt(power / (1 - own)))


def _measure_rounding(values: Floats, valid: Mask) -> float:
    """Return the deviation of rounding to the smallest step between neighbours that occurs often.

    Where a joint never rests, its own motion makes the smallest steps: the noise is then
    overestimated, which is the side on which a start state may be: smoothing rounds the kinks of a
    motion by more than noise does.
    """
    steps = np.abs(np.diff(values))[valid[1:] & valid[:-1]]
    steps = steps[steps > 0]
    if len(steps) < FEWEST_STEPS:
        return LEAST_NOISE
    return float(np.quantile(steps, SMALLEST_STEP_QUANTILE)) / np.sqrt(12.0)
