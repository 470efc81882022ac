"""From a measured curve to a name: the shape that does as well."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.measuring.curve import Curve
from pendulum_sysid.measuring.formula_fit import fit_formula
from pendulum_sysid.measuring.penalised_fit import LawFit
from pendulum_sysid.measuring.shape_fit import FittedShape, is_place_seen, rank_shapes
from pendulum_sysid.measuring.shapes import (
    GAIN_TIME_SHAPES,
    SHAPES,
    SPEED_SHAPES,
    TIME_SHAPES,
    TURN_SHAPES,
    Shape,
)
from pendulum_sysid.records import Fit, Split
from pendulum_twin.arrays import Floats
from pendulum_twin.laws.kind import LawKind, Role, Variable
from pendulum_twin.laws.law import make_curve_matrix

FORMULA_ITERATIONS = 20


@dataclass(frozen=True)
class NamedCurve:
    """Hold a measured curve with its band and, where one does as well, its shape.

    values: (knots,) of the law in the twin.
    band: (knots,) half widths of 95 % intervals; wide where nothing was visited.
    effective: effective number of parameters.
    shape: None where no shape does as well as the curve, or where a formula is doubted.
    is_doubted: whether the values follow a formula of which the spread over blocks of time leaves
        nothing sure: the law is told as its curve.
    """

    curve: Curve
    values: Floats
    band: Floats
    effective: float
    shape: FittedShape | None
    is_doubted: bool = False


def name_curves(
    case: Case, split: Split, law_fit: LawFit, time_first: bool = False
) -> tuple[Fit, tuple[NamedCurve, ...]]:
    """Return the fit with every curve replaced by its formula where the formula does as well.

    time_first: whether curves over time come first, before formulas of other curves have left a
        little more than these curves.
    """
    fit, named = law_fit.fit, dict[int, NamedCurve]()
    timed = [time_first and c.kind.variable is Variable.TIME for c in law_fit.curves]
    for k in sorted(range(len(timed)), key=lambda k: not timed[k]):
        curve = law_fit.curves[k]
        fit, curve, shape = _try_shapes(
            case,
            split,
            fit,
            curve,
            law_fit.values[k],
            law_fit.covariances[k],
            law_fit.inflation,
        )
        spread = make_curve_matrix(curve.kind, law_fit.curves[k].knots, curve.knots)
        covariance = spread @ law_fit.covariances[k] @ spread.T
        named[k] = NamedCurve(
            curve,
            curve.get_values(fit.theta),
            decisions.INTERVAL_DEVIATIONS * np.sqrt(np.maximum(np.diag(covariance), 0.0)),
            law_fit.priors[k].effective,
            shape,
        )
    return fit, tuple(named[k] for k in sorted(named))


def _try_shapes(
    case: Case,
    split: Split,
    fit: Fit,
    curve: Curve,
    values: Floats,
    covariance: Floats,
    inflation: float,
) -> tuple[Fit, Curve, FittedShape | None]:
    """Return the fit, curve and shape of the best shape that runs cannot tell from the curve.

    The shapes nearest to the curve are tried; without such a shape the fit and the curve stay.
    """
    slack = (decisions.SHAPE_SLACK * float(np.ptp(values))) ** 2 * np.eye(len(values))
    ranked = rank_shapes(select_shapes(curve.kind), curve.knots, values, covariance + slack)
    tried = []
    for shape in ranked[: decisions.SHAPES_TRIED]:
        try:
            formula, named, finer = fit_formula(
                case, split, fit, curve, shape, FORMULA_ITERATIONS, inflation
            )
        except np.linalg.LinAlgError:  # its runs fix no step
            continue
        is_as_good = formula.choose <= decisions.SHAPE_AS_GOOD * fit.choose
        if is_as_good and is_certain(named) and is_place_seen(named, curve.knots):
            tried.append((formula, finer, named))
    if not tried:
        return fit, curve, None
    return min(tried, key=lambda trial: trial[0].choose)


def select_shapes(kind: LawKind) -> tuple[Shape, ...]:
    """Return the shapes that a curve of a kind may have."""
    if kind.remembers:
        return ()  # the curve says how much slips where, and is no formula of a state
    if kind.variable is Variable.SHAFT:
        return ()  # segments, teeth and magnets of a motor: many waves a turn at once
    if kind.is_periodic:
        return TURN_SHAPES
    if kind.variable is Variable.TIME:
        return GAIN_TIME_SHAPES if kind.role is Role.GAIN else TIME_SHAPES
    return SHAPES if kind.variable is Variable.POSITION else SPEED_SHAPES


def is_certain(shape: FittedShape) -> bool:
    """Return whether the interval of a factor leaves out 0; of the offset only where it is all.

    The two sides of a place have to differ, and of a sum each part has to be sure. Something has
    to fix every parameter, and what repeats has a period that is surely not 0.
    """
    factors = shape.shape.factors
    if not np.all(np.isfinite(shape.deviations)):
        return False
    if shape.shape.two_sided:
        apart = abs(float(shape.values[1] - shape.values[0]))
        return apart > decisions.INTERVAL_DEVIATIONS * float(np.hypot(*shape.deviations[:2]))
    sure = np.abs(shape.values) > decisions.INTERVAL_DEVIATIONS * shape.deviations
    by_name = dict(zip(shape.names, sure, strict=True))
    if not by_name.get("period", True):
        return False
    if shape.shape.parts:
        return all(any(by_name[name] for name in part) for part in shape.shape.parts)
    first = 0 if len(factors) == 1 else 1
    return bool(np.any(sure[first : len(factors)]))
