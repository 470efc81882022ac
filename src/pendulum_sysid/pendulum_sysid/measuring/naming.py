"""From a measured curve to a name: the shape that does as well, its formula and its sentence."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.finding.judge import compute_lead
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.gauss_newton import refine_start_states
from pendulum_sysid.fitting.parameters import list_rig_parameters, make_twin
from pendulum_sysid.fitting.windows import shorten_windows
from pendulum_sysid.measuring.curve import Curve
from pendulum_sysid.measuring.penalised_fit import LawFit
from pendulum_sysid.measuring.shapes import FittedShape, rank_shapes
from pendulum_sysid.records import Fit, Split
from pendulum_twin.arrays import Floats

SHAPES_TRIED = 3  # of a curve, the most believable, that are run


@dataclass(frozen=True)
class NamedCurve:
    """Hold a measured curve with its band and, where one does as well, its shape.

    values: (knots,) of the law in the twin.
    band: (knots,) half widths of 95 % intervals; wide where nothing was visited.
    effective: effective number of parameters.
    shape: None where no shape does as well as the curve.
    lead: how far the twin is ahead with the law, a ratio of misfits.
    """

    curve: Curve
    values: Floats
    band: Floats
    effective: float
    shape: FittedShape | None
    lead: float


def name_curves(case: Case, split: Split, held: LawFit) -> tuple[Fit, tuple[NamedCurve, ...]]:
    """Return the fit with every curve replaced by its formula where the formula does as well."""
    fit, named = held.fit, []
    for k, curve in enumerate(held.curves):
        shape, fit = _try_shapes(case, split, fit, curve, held.values[k], held.covariances[k])
        deviations = np.sqrt(np.maximum(np.diag(held.covariances[k]), 0.0))
        named.append(
            NamedCurve(
                curve,
                curve.get_values(fit.theta),
                decisions.INTERVAL_DEVIATIONS * deviations,
                held.priors[k].effective,
                shape,
                held.lead.ratio if held.lead is not None else 1.0,
            )
        )
    return fit, tuple(named)


def _try_shapes(
    case: Case, split: Split, fit: Fit, curve: Curve, values: Floats, covariance: Floats
) -> tuple[FittedShape | None, Fit]:
    """Return the first shape that the runs cannot tell from the curve, and the fit with it."""
    ranked = rank_shapes(curve.kind.is_periodic, curve.knots, values, covariance)
    for shape in ranked[:SHAPES_TRIED]:
        theta = fit.theta.copy()
        curve.put(theta, np.maximum(shape.curve, curve.low))
        formula = _judge(case, split, fit, theta)
        worse = compute_lead(fit, formula)
        as_good = formula.choose <= decisions.SHAPE_AS_GOOD * fit.choose
        if as_good or not (worse.is_real or formula.choose > 1.5 * fit.choose):
            return shape, formula
    return None, fit


def _judge(case: Case, split: Split, fit: Fit, theta: Floats) -> Fit:
    """Return a fit with another theta, judged on the choosing windows; nothing is refitted."""
    choosing = refine_start_states(
        case.problem(shorten_windows(case.state, split.choose, fit.pieces)), theta
    )
    return replace(
        fit,
        twin=make_twin(case.twin, theta, fit.effects, list_rig_parameters(case.twin)),
        theta=theta,
        choose=choosing.misfit(case.noise),
        window_squares=choosing.squares,
        counts=choosing.counts,
    )


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
    kind, unit = named.curve.kind, named.curve.kind.quantity.unit.replace("1", "")
    subject = f"The {kind.quantity.words} depends on the {kind.along.words}"
    if named.shape is None:
        seen = named.curve.visits >= decisions.LAW_VISITED * named.curve.visits.mean()
        values, knots = named.values[seen], named.curve.knots[seen]
        low, high = int(np.argmin(values)), int(np.argmax(values))
        sentence = (
            f"{subject}: from {values[low]:.3g} {unit} at {knots[low]:.3g} to {values[high]:.3g} "
            f"{unit} at {knots[high]:.3g} {kind.along.unit}; no formula that was tried does as "
            "well as the measured curve."
        )
        return sentence.replace("  ", " ").replace(" 1;", ";")
    shape = named.shape
    half = decisions.INTERVAL_DEVIATIONS * shape.deviations
    numbers = {
        name: f"{value:.3g} [{value - wide:.3g}, {value + wide:.3g}]"
        for name, value, wide in zip(shape.names, shape.values, half, strict=True)
    }
    return f"{subject}: it {shape.shape.words.format(**numbers)} ({shape.shape.name})."
