"""How smooth and how large a curve is: a Gaussian process, chosen by its marginal likelihood.

The values at the knots are a priori draws of a Gaussian process of Matern's kind (5/2), whose size
and length are those under which the recording is likeliest (MacKay, Neural Computation 4 (1992)
415; Kennedy and O'Hagan, J. R. Stat. Soc. B 63 (2001) 425, for what a model lacks). All other
parameters are eliminated, each without any prior.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pendulum_sysid.measuring.curve import Curve
from pendulum_twin.arrays import Floats

LENGTHS = (0.7, 1.2, 2.0, 3.5, 6.0, 12.0, 30.0)  # spacings, that are tried
SIZES = np.geomspace(1e-4, 30.0, 40)  # typical sizes, that are tried
BLIND = 1e-6  # of the largest power, below which a direction is lost in the differences
JITTER = 1e-6  # of the variance, so that the covariance can be inverted


@dataclass(frozen=True)
class Smoothness:
    """Hold the prior of a curve.

    size: standard deviation of its values, in typical sizes.
    length: over which it bends, in spacings of its knots.
    evidence: log of how much likelier the recording is with the curve than without, nats.
    effective: effective number of parameters.
    """

    size: float
    length: float
    evidence: float
    effective: float


def make_correlation(curve: Curve, length: float) -> Floats:
    """Return the prior correlation (knots, knots) of a curve's values; length: of `Smoothness`."""
    count = len(curve.knots)
    apart = np.abs(np.arange(count)[:, None] - np.arange(count))
    if curve.kind.is_periodic:
        turn = 2 * np.pi / count
        apart = 2.0 * np.sin(0.5 * turn * apart) / turn  # along the chord: stays a covariance
    z = np.sqrt(5.0) * apart / length
    return np.asarray((1.0 + z + z * z / 3.0) * np.exp(-z))


def make_covariance(curve: Curve, length: float) -> Floats:
    """Return the prior covariance (knots, knots) of a curve's values, of unit size."""
    covariance = make_correlation(curve, length)
    toward = covariance @ curve.gauges.T
    shared = np.linalg.pinv(curve.gauges @ toward, rcond=1e-12, hermitian=True)
    covariance = covariance - toward @ shared @ toward.T
    return np.asarray(covariance + JITTER * np.eye(len(covariance)))


def eliminate(normal: Floats, gradient: Floats, count: int) -> tuple[Floats, Floats]:
    """Return matrix and gradient of the last `count` parameters, the others following freely.

    What the others do as well (a gain that is the same everywhere) counts as not seen at all.
    """
    rest = slice(0, len(gradient) - count)
    own = slice(len(gradient) - count, len(gradient))
    follow = np.linalg.pinv(normal[rest, rest], rcond=1e-12, hermitian=True) @ normal[rest, own]
    matrix = normal[own, own] - normal[own, rest] @ follow
    power, along = np.linalg.eigh(0.5 * (matrix + matrix.T))
    seen = power > BLIND * np.linalg.norm(normal[own, own], 2)
    along, power = along[:, seen], power[seen]
    left = gradient[own] - follow.T @ gradient[rest]
    return (along * power) @ along.T, along @ (along.T @ left)


def choose_smoothness(
    curve: Curve, matrix: Floats, gradient: Floats, inflation: float
) -> Smoothness:
    """Return the prior under which the recording is likeliest, to first order.

    matrix, gradient: of the curve's values in typical sizes, all else eliminated, such that the
        values without a prior are their quotient.
    inflation: by which correlated errors count for less than their number.
    """
    best = Smoothness(0.0, LENGTHS[-1], -np.inf, 0.0)
    for length in LENGTHS:
        root = np.linalg.cholesky(make_covariance(curve, length))
        power, turned = np.linalg.eigh(root.T @ matrix @ root / inflation)
        power = power.clip(0.0)
        along = (turned.T @ (root.T @ gradient) / inflation) ** 2
        grown = SIZES[:, None] ** 2 * power
        nats = 0.5 * np.sum(SIZES[:, None] ** 2 * along / (1 + grown) - np.log1p(grown), axis=1)
        k = int(np.argmax(nats))
        if nats[k] > best.evidence:
            effective = float(np.sum(grown[k] / (1 + grown[k])))
            best = Smoothness(float(SIZES[k]), length, float(nats[k]), effective)
    return best


def make_precision(curve: Curve, smoothness: Smoothness) -> Floats:
    """Return the inverse of the prior covariance, in typical sizes."""
    covariance = smoothness.size**2 * make_covariance(curve, smoothness.length)
    precision: Floats = np.linalg.inv(covariance)
    return precision
