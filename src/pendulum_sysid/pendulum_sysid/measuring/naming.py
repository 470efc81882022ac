"""From a measured curve to a name: the shape that does as well, its formula and its sentence."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.measuring.curve import Curve
from pendulum_sysid.measuring.formula_fit import fit_formula
from pendulum_sysid.measuring.penalised_fit import LawFit
from pendulum_sysid.measuring.shapes import (
    GAIN_TIME_SHAPES,
    SHAPES,
    SPEED_SHAPES,
    TIME_SHAPES,
    TURN_SHAPES,
    FittedShape,
    Shape,
    is_place_seen,
    rank_shapes,
)
from pendulum_sysid.records import Fit, Split
from pendulum_twin.arrays import Floats
from pendulum_twin.laws.kind import LawKind, Role, Variable
from pendulum_twin.laws.law import compute_turn, make_curve_matrix

FORMULA_ITERATIONS = 20
NO_FRICTION = "Where all dry friction together is below 0, there is none."
HYSTERESIS_SHARES = (0.1, 0.9)  # of the friction: those ways are said of it


@dataclass(frozen=True)
class NamedCurve:
    """Hold a measured curve with its band and, where one does as well, its shape.

    values: (knots,) of the law in the twin.
    band: (knots,) half widths of 95 % intervals; wide where nothing was visited.
    effective: effective number of parameters.
    shape: None where no shape does as well as the curve.
    """

    curve: Curve
    values: Floats
    band: Floats
    effective: float
    shape: FittedShape | None


def name_curves(case: Case, split: Split, law_fit: LawFit) -> tuple[Fit, tuple[NamedCurve, ...]]:
    """Return the fit with every curve replaced by its formula where the formula does as well."""
    fit, named = law_fit.fit, []
    for k, curve in enumerate(law_fit.curves):
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
        named.append(
            NamedCurve(
                curve,
                curve.get_values(fit.theta),
                decisions.INTERVAL_DEVIATIONS * np.sqrt(np.maximum(np.diag(covariance), 0.0)),
                law_fit.priors[k].effective,
                shape,
            )
        )
    return fit, tuple(named)


def _try_shapes(
    case: Case,
    split: Split,
    fit: Fit,
    curve: Curve,
    values: Floats,
    covariance: Floats,
    inflation: float,
) -> tuple[Fit, Curve, FittedShape | None]:
    """Return the fit, curve and shape of the first shape that runs cannot tell from the curve."""
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
        if is_as_good and _is_certain(named) and is_place_seen(named, curve.knots):
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


def _is_certain(shape: FittedShape) -> bool:
    """Return whether the interval of a factor leaves out 0; of the offset only where it is all.

    Of an edge the two sides have to differ, and of a sum each part has to be sure. Something has
    to fix every parameter, and what repeats has a period that is surely not 0.
    """
    factors = shape.shape.factors
    if not np.all(np.isfinite(shape.deviations)):
        return False
    if shape.shape.edge:
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


def write_formula(named: NamedCurve) -> str:
    """Return the formula with its numbers and units; "" for a curve without a shape."""
    shape, kind = named.shape, named.curve.kind
    if shape is None:
        return ""
    numbers = {n: f"{v:.3g}" for n, v in zip(shape.names, shape.values, strict=True)}
    text = (
        shape.shape.text.format(**numbers)
        .replace("+ -", "- ")
        .replace("x0", f"{named.curve.knots[0]:.3g}")
    )
    unit = "" if kind.quantity.unit == "1" else f" in {kind.quantity.unit}"
    along = "" if kind.along.unit == "1" else f" in {kind.along.unit}"
    return f"{kind.quantity.words}{unit} = {text}, x: {kind.along.words}{along}"


def write_sentence(named: NamedCurve) -> str:
    """Return what was measured, for a person."""
    if named.curve.kind.remembers and np.any(named.values):
        return _write_hysteresis(named)
    kind, unit = named.curve.kind, named.curve.kind.quantity.unit.replace("1", "")
    subject = f"The {kind.quantity.words} depends on the {kind.along.words}"
    if kind.variable is Variable.SHAFT:
        subject += f", which is {compute_turn(named.curve.knots):.3g} m"
    if named.shape is None:
        seen = named.curve.visits >= decisions.LAW_VISITED * named.curve.visits.mean()
        values, knots = named.values[seen], named.curve.knots[seen]
        low, high = int(np.argmin(values)), int(np.argmax(values))
        why = (
            "no formula that was tried does as well as the measured curve"
            if select_shapes(kind)
            else "no formula was tried"
        )
        sentence = (
            f"{subject}: from {values[low]:.3g} {unit} at {knots[low]:.3g} to {values[high]:.3g} "
            f"{unit} at {knots[high]:.3g} {kind.along.unit}; {why}."
        )
        return _add_friction(sentence.replace("  ", " ").replace(" 1;", ";"), named)
    shape = named.shape
    half = decisions.INTERVAL_DEVIATIONS * shape.deviations
    numbers = {
        name: f"{value:.3g} [{value - wide:.3g}, {value + wide:.3g}]"
        for name, value, wide in zip(shape.names, shape.values, half, strict=True)
    }
    words = f"{subject}: it {shape.shape.words.format(**numbers)} ({shape.shape.name})."
    return _add_friction(words, named)


def _add_friction(sentence: str, named: NamedCurve) -> str:
    """Return the sentence with what a dry friction below 0 means, where the law has one."""
    is_dry = named.curve.kind.role in (Role.CART_DRY, Role.POLE_DRY)
    return f"{sentence} {NO_FRICTION}" if is_dry and np.any(named.values < 0.0) else sentence


def _write_hysteresis(named: NamedCurve) -> str:
    """Return how much friction slips, and after which way, for a person."""
    kind, knots = named.curve.kind, named.curve.knots
    share = np.cumsum(named.values) / np.sum(named.values)
    first, last = (knots[np.searchsorted(share, part)] for part in HYSTERESIS_SHARES)
    words = kind.quantity.words
    return (
        f"{words[0].upper()}{words[1:]}: {np.sum(named.values):.3g} {kind.quantity.unit} in all. "
        f"After each reversal it grows like a spring, and slips from {first:.3g} to {last:.3g} "
        f"{kind.along.unit} (a tenth of it to nine tenths of it)."
    )
