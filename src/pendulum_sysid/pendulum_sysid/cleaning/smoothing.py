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

from pendulum_twin.arrays import Floats, Ints, Mask

DEGREE = 5
HALF_LENGTHS = (4, 5, 6, 8, 10, 13, 16, 20, 26, 32, 40, 52, 64, 80)
FEWEST_STEPS = 10  # steps between samples that say something of the rounding
SMALLEST_STEP_QUANTILE = 0.01  # of the steps: smaller ones are chance
LEAST_NOISE = 1e-12  # m, rad: where the signal never moves


@dataclass(frozen=True)
class Scatter:
    """Hold how far samples lie from the polynomials about them.

    left_out: mean squared leave-one-out error, in the unit of the samples, squared.
    deviation: standard deviation of a sample's noise, by the residuals.
    """

    left_out: float
    deviation: float


@dataclass(frozen=True)
class Smooth:
    """Hold a smoothed signal of n samples.

    value: (n,) in the signal's unit.
    rate: (n,) in the signal's unit per s.
    value_noise, rate_noise: standard deviation of value and rate.
    half_length: samples to either side that each polynomial spans.
    """

    value: Floats
    rate: Floats
    value_noise: float
    rate_noise: float
    half_length: int


def smooth(values: Floats, valid: Mask, stretches: tuple[slice, ...], period_s: float) -> Smooth:
    """Smooth a signal within each stretch.

    values: (n,) m or rad; samples that are not valid hold placeholders.
    valid: (n,) False where a sample says nothing of the noise.
    stretches: of the samples; together they cover all of them.

    The deviations follow from the scatter about the polynomials, or from a rounding to the
    encoder's step, whichever is larger: kinks of the motion count like noise.
    """
    halves = list_halves(HALF_LENGTHS, valid, stretches)
    to_end = count_to_end(stretches)
    scatters = {
        h: measure_scatter(compute_residuals(values, h), valid & (to_end >= h), h) for h in halves
    }
    half = min(scatters, key=lambda h: scatters[h].left_out)
    value, rate = (differentiate(values, stretches, period_s, half, d) for d in (0, 1))
    noise = max(scatters[half].deviation, _measure_rounding(values, valid))
    gains = [compute_noise_gain(half, period_s, d) for d in (0, 1)]
    return Smooth(value, rate, noise * gains[0], noise * gains[1], half)


def list_halves(
    halves: tuple[int, ...], valid: Mask, stretches: tuple[slice, ...]
) -> tuple[int, ...]:
    """Return the half lengths whose polynomials a stretch with valid samples can hold."""
    lengths = [stretch.stop - stretch.start for stretch in stretches]
    counting = [n for n, s in zip(lengths, stretches, strict=True) if valid[s].any()] or lengths
    return tuple(h for h in halves if 2 * h + 1 <= max(counting)) or halves[:1]


def count_to_end(stretches: tuple[slice, ...]) -> Ints:
    """Return for every sample how many samples lie to the nearer end of its stretch, (n,)."""
    lengths = [stretch.stop - stretch.start for stretch in stretches]
    return np.concatenate([np.minimum(np.arange(n), np.arange(n)[::-1]) for n in lengths])


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


def compute_residuals(values: Floats, half: int) -> Floats:
    """Return values (n,) minus the polynomial about every sample, (n,), in their unit.

    half: samples to either side that each polynomial spans; nearer to an end of a stretch the
        residual means nothing.
    """
    weights = _fit_weights(2 * half + 1, 0)[half]
    residuals: Floats = values - correlate1d(values, weights, mode="nearest")
    return residuals


def measure_scatter(residuals: Floats, counts: Mask, half: int) -> Scatter:
    """Return the scatter of values about their polynomials.

    residuals: (n,) as of `compute_residuals`.
    counts: (n,) True where a sample counts and lies so far inside its stretch.

    The error is infinite where fewer samples count than a polynomial spans: they tell nothing.
    """
    counting, length = residuals[counts], 2 * half + 1
    if len(counting) < length:
        return Scatter(np.inf, 0.0)
    power = float(np.mean(counting**2))
    own = float(_fit_weights(length, 0)[half, half])
    return Scatter(power / (1 - own) ** 2, float(np.sqrt(power / (1 - own))))


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
