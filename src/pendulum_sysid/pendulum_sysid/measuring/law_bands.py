"""Bands of measured laws that hold how far blocks of time draw the laws apart.

The errors of a fit tell how far noise moves a curve. What no law and no name explains draws the
curve, too, and otherwise in every block of time, as it draws the rig's constants
(`fitting.block_spread`). The next recording is such a block.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.fitting.block_spread import compute_pseudo_covariance, sum_blocks
from pendulum_sysid.measuring.curve import Curve
from pendulum_sysid.measuring.measure import Measured
from pendulum_sysid.measuring.naming import NamedCurve, is_certain
from pendulum_sysid.measuring.penalised_fit import (
    LawFit,
    list_all_free,
    list_parts,
    make_penalty,
)
from pendulum_sysid.measuring.shape_fit import FittedShape, draw_slopes
from pendulum_sysid.measuring.smoothness import Smoothness, make_correlation
from pendulum_twin.arrays import Floats
from pendulum_twin.laws.law import make_curve_matrix


def widen_bands(measured: Measured) -> tuple[NamedCurve, ...]:
    """Return the laws with bands, and intervals of formulas, that hold the spread over blocks.

    At the noise they stay: there blocks differ by noise alone, which bands hold already. A formula
    of which the spread leaves nothing sure is none: the law is told as its curve. Over time a law
    has a formula or is none.
    """
    laws, law_fit = measured.named[1], measured.law_fit
    if measured.named[0].choose <= decisions.MISFIT_AT_NOISE:
        return laws
    spreads = measure_law_spreads(measured)
    given = zip(laws, law_fit.curves, law_fit.priors, spreads, strict=True)
    return tuple(_widen(*each) for each in given)


def measure_law_spreads(measured: Measured) -> list[Floats]:
    """Return the covariance (knots, knots) of each curve between blocks of time, in its unit.

    It is 0 where the recording has too few windows for blocks.
    """
    law_fit: LawFit = measured.law_fit
    fit, curves = law_fit.fit, law_fit.curves
    free = list_all_free(measured.case, fit.effects, fit.theta, curves)
    parts = list_parts(len(free), curves)
    assert law_fit.system is not None
    blocks = sum_blocks(law_fit.system, fit.pieces)
    if blocks is None:
        return [np.zeros((len(curve.knots), len(curve.knots))) for curve in curves]
    penalty = make_penalty(len(free), curves, law_fit.priors, law_fit.inflation)
    # At the optimum the priors balance the sum of all scores: each block bears an equal share.
    centred = replace(blocks, scores=blocks.scores - blocks.scores.mean(axis=0))
    covariance, _ = compute_pseudo_covariance(centred, fit.choose, penalty)
    sizes = np.array([parameter.size for parameter in free])
    return [covariance[part, part] * np.outer(sizes[part], sizes[part]) for part in parts]


def _widen(named: NamedCurve, curve: Curve, prior: Smoothness, spread: Floats) -> NamedCurve:
    """Return a law with the spread (knots, knots) of its measured curve in its intervals.

    A few blocks tell little of a single value: its spread is averaged over the values nearby, as
    far as the curve is alike.
    """
    nearby = make_correlation(curve, prior.length)
    squares = (nearby / nearby.sum(axis=1, keepdims=True)) @ np.diag(spread)
    at = make_curve_matrix(curve.kind, curve.knots, named.curve.knots)
    more = decisions.INTERVAL_DEVIATIONS * np.sqrt(np.maximum(at @ squares, 0.0))
    shape = named.shape
    if shape is not None:
        apart = _project(shape, named.curve.knots, at @ spread @ at.T)
        shape = replace(shape, deviations=np.hypot(shape.deviations, apart))
    doubted = shape is not None and not (is_certain(shape) or curve.kind.timed)
    band = np.hypot(named.band, more)
    return replace(named, band=band, shape=None if doubted else shape, is_doubted=doubted)


def _project(fitted: FittedShape, x: Floats, covariance: Floats) -> Floats:
    """Return the deviations (parameters,) of a shape that follows errors of a curve.

    x: (knots,) places of the curve.
    covariance: (knots, knots) of its errors there.
    """
    follow = np.linalg.pinv(draw_slopes(fitted.shape, x, fitted.values), rcond=1e-12)
    return np.sqrt(np.maximum(np.diag(follow @ covariance @ follow.T), 0.0))
