"""Fit a shape to a measured curve with its band, and rank shapes by how well they do.

For every start of the parameters in which a shape is not linear, its factors follow by least
squares (variable projection; Golub and Pereyra, SIAM J. Numer. Anal. 10 (1973) 413), and the best
start is refined.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.optimize import least_squares

from pendulum_sysid.measuring.shapes import PLACES, Shape
from pendulum_twin.arrays import Floats


@dataclass(frozen=True)
class FittedShape:
    """Hold a shape with its parameters.

    values: (parameters,) factors, then the others.
    deviations: (parameters,) their standard deviations.
    curve: (knots,) its values at the knots.
    misfit: sum of squares in units of the curve's own uncertainty.
    """

    shape: Shape
    values: Floats
    deviations: Floats
    curve: Floats
    misfit: float

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the parameters."""
        return (*self.shape.factors, *self.shape.more)

    @property
    def cost(self) -> float:
        """Return the misfit with what its parameters may fit by chance (Schwarz, 1978)."""
        return self.misfit + len(self.values) * float(np.log(len(self.curve)))


def fit_shape(shape: Shape, x: Floats, y: Floats, root: Floats) -> FittedShape:
    """Return the shape nearest to a curve.

    x, y: (knots,) the curve.
    root: (k, knots) such that root @ error has independent parts of unit variance.
    """
    low, span = float(x.min()), float(np.ptp(x))
    best: tuple[float, tuple[float, ...]] = (np.inf, ())
    for start in product(*shape.starts(low, span, len(x))):
        misfit = float(np.sum(_solve(shape, x, y, root, start)[1] ** 2))
        best = min(best, (misfit, start), key=lambda pair: pair[0])
    more = np.array(best[1])
    if len(more):
        scale = np.where(more == 0.0, span, np.abs(more))
        refined = least_squares(
            lambda z: _solve(shape, x, y, root, z * scale)[1], more / scale, max_nfev=60
        )
        more = refined.x * scale
    factors, off = _solve(shape, x, y, root, more)
    values = np.concatenate([factors, more])
    curve = shape.draw_columns(x, more) @ factors
    return FittedShape(
        shape,
        values,
        _compute_deviations(shape, x, root, values, float(np.sum(off**2))),
        curve,
        float(np.sum(off**2)),
    )


def _solve(
    shape: Shape, x: Floats, y: Floats, root: Floats, more: Sequence[float] | Floats
) -> tuple[Floats, Floats]:
    """Return the factors and what they leave, in units of uncertainty."""
    weighted = root @ shape.draw_columns(x, more)
    factors = np.linalg.lstsq(weighted, root @ y, rcond=1e-12)[0]
    return factors, root @ y - weighted @ factors


def _compute_deviations(
    shape: Shape, x: Floats, root: Floats, values: Floats, misfit: float
) -> Floats:
    weighted = root @ draw_slopes(shape, x, values)
    spread = np.linalg.pinv(weighted.T @ weighted, rcond=1e-12, hermitian=True)
    wider = max(1.0, misfit / max(len(x) - len(values), 1))
    return np.sqrt(np.maximum(np.diag(spread), 0.0) * wider)


def draw_slopes(shape: Shape, x: Floats, values: Floats) -> Floats:
    """Return how the curve changes with the parameters of its shape, (knots, parameters)."""
    count = len(shape.factors)

    def draw(values: Floats) -> Floats:
        return np.asarray(shape.draw_columns(x, values[count:]) @ values[:count])

    slopes = np.empty((len(x), len(values)))
    for k, value in enumerate(values):
        step = 1e-5 * max(abs(float(value)), 1e-9)
        moved = values.copy()
        moved[k] += step
        slopes[:, k] = (draw(moved) - draw(values)) / step
    return slopes


def rank_shapes(
    shapes: Sequence[Shape], x: Floats, y: Floats, covariance: Floats
) -> list[FittedShape]:
    """Return the shapes fitted to a curve, the most believable first.

    A straight line that ends in a bend is also the flank of a bump five times as far away as the
    curve reaches: a shape whose place was not seen is left out.

    covariance: (knots, knots) of y.
    """
    power, along = np.linalg.eigh(covariance)
    kept = power > 1e-10 * power[-1]
    root = (along[:, kept] / np.sqrt(power[kept])).T
    fitted = [fit_shape(shape, x, y, root) for shape in shapes if len(x) > len(shape.factors) + 2]
    seen = [shape for shape in fitted if is_place_seen(shape, x)]
    return sorted(seen, key=lambda shape: shape.cost)


def is_place_seen(fitted: FittedShape, x: Floats) -> bool:
    """Return whether the middle of a bump or an edge lies on the curve: else nothing shows it."""
    places = [v for n, v in zip(fitted.names, fitted.values, strict=True) if n in PLACES]
    return all(x.min() <= place <= x.max() for place in places)
