"""Fit a formula in place of its curve: its parameters, the rig and all effects, by free runs."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag

from pendulum_sysid import decisions
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.cross_validation import compute_left_out_misfit, cross_validate
from pendulum_sysid.fitting.fit import widen_estimates
from pendulum_sysid.fitting.gauss_newton import complete_system, solve
from pendulum_sysid.fitting.parameters import (
    Free,
    list_free_parameters,
    list_rig_parameters,
    make_twin,
)
from pendulum_sysid.fitting.windows import shorten_windows
from pendulum_sysid.measuring.curve import Curve, find_slot
from pendulum_sysid.measuring.penalised_fit import invert_normal, make_estimates
from pendulum_sysid.measuring.shape_fit import FittedShape
from pendulum_sysid.measuring.shapes import Shape
from pendulum_sysid.records import Fit, Split
from pendulum_twin.arrays import Floats, Mask
from pendulum_twin.laws.kind import LIMITS
from pendulum_twin.laws.law import MOST_KNOTS, compute_turn, spread_turn
from pendulum_twin.parameter_vector import LAW_SIZE, LAWS, VALUES

GAUGE_WEIGHT = 1e4  # a hundredth of a formula's height in its mean counts as a deviation
EDGE_STEPS = 2.0  # knots of the curve, to either side, within which its edge lies
EDGE_WIDTHS = 8.0  # widths of an edge, beyond which it is constant to 0.04 %
# Widths in knots of the formula: a fit finds a sharp edge by a softer edge, which more runs feel.
EDGE_SOFT, EDGE_SHARP = 3.0, 1.0
FORMULA_KNOTS = 120  # a wave of 0.3 Hz over a minute; the other places hold the parameters


@dataclass(frozen=True)
class ShapeParameter:
    """A parameter of a formula as a free parameter of a fit; it has the interface of `Free`.

    The parameters lie behind the values in the law's slot of theta, where the kernel reads
    nothing; a change of one draws the values anew.

    at: where the law's values begin in theta.
    k: which of the shape's parameters.
    lowest, highest: values that the law may have.
    """

    name: str
    shape: Shape
    knots: tuple[float, ...]
    at: int
    k: int
    size: float
    lowest: float
    highest: float
    low: float = -np.inf
    high: float = np.inf
    belief: float = 0.0
    acts: Mask | None = None

    def compute_pull(self, theta: Floats) -> float:
        """Return 0: nothing is believed of a formula beforehand."""
        return 0.0

    def get(self, theta: Floats) -> float:
        """Return the value that theta (SIZE,) holds."""
        return float(theta[self.at + len(self.knots) + self.k])

    def put(self, theta: Floats, value: float) -> None:
        """Set the value in theta (SIZE,), and the law's values with it."""
        count, factors = len(self.knots), len(self.shape.factors)
        begin = self.at + count
        theta[begin + self.k] = value
        numbers = theta[begin : begin + factors + len(self.shape.more)]
        columns = self.shape.draw_columns(np.array(self.knots), numbers[factors:])
        values = columns @ numbers[:factors]
        theta[self.at : self.at + count] = np.clip(values, self.lowest, self.highest)


def place_knots(curve: Curve, fitted: FittedShape) -> Curve:
    """Return the curve with the knots of a formula: finer, and somewhat beyond what was visited.

    A formula says how a law goes on, as an effect of the catalogue does. All knots of an edge lie
    about its place, as far as the curve leaves the place open: a law is constant beyond its knots.
    """
    if curve.kind.is_periodic:
        return replace(curve, knots=spread_turn(FORMULA_KNOTS, compute_turn(curve.knots)))
    low, high = float(curve.seen.min()), float(curve.seen.max())
    if not curve.kind.timed:
        reach = decisions.FORMULA_REACH * (high - low)
        low, high = low - reach, high + reach
    if fitted.shape.edge:
        place, width = fitted.values[len(fitted.shape.factors) :]
        reach = max(EDGE_STEPS * float(np.ptp(curve.knots[:2])), EDGE_WIDTHS * abs(float(width)))
        place = np.clip(place, low, high)
        low, high = max(low, place - reach), min(high, place + reach)
    return replace(curve, knots=np.linspace(low, high, FORMULA_KNOTS))


def fit_formula(
    case: Case,
    split: Split,
    fit: Fit,
    curve: Curve,
    fitted: FittedShape,
    wanted: int,
    inflation: float,
) -> tuple[Fit, FittedShape, Curve]:
    """Return the fit with a formula in place of a curve, the formula's parameters, and its knots.

    fit: its theta holds the curve.
    fitted: the shape, as it is nearest to the curve.
    wanted: iterations at most.
    inflation: by which errors scatter more from window to window than independent errors would
        (variances); `LAW_FIRST_INFLATION` at least, because a formula is rarely the exact law.
    """
    finer = place_knots(curve, fitted)
    theta, parameters = _free_shape(fit.theta, finer, fitted)
    rig = list_free_parameters(case.twin, fit.effects, case.scales)
    free: tuple[Free, ...] = (*rig, *parameters)  # type: ignore[arg-type]
    sizes = np.array([parameter.size for parameter in parameters])
    own = 1e-6 * np.eye(len(sizes)) + _hold_gauges(finer, fitted, sizes)
    weak = block_diag(np.zeros((len(rig), len(rig))), own)
    problem = case.problem(shorten_windows(case.state, split.learn, fit.pieces))
    begun = solve(problem, theta, free, fit.start_states, wanted, weak)
    if fitted.shape.edge and free[-1].get(begun.theta) <= free[-1].low:
        free = _sharpen(free)
        free[-1].put(begun.theta, free[-1].low)
        begun = solve(problem, begun.theta, free, begun.start_states, wanted, weak)
    solved = complete_system(problem, begun, free)
    assert solved.system is not None
    covariance = invert_normal(solved.system.normal + weak)
    left_out = cross_validate(problem, solved, free, fit.pieces, weak)
    clean = solved.theta.copy()
    numbers = np.array([parameter.get(clean) for parameter in parameters])
    begin = parameters[0].at + FORMULA_KNOTS
    clean[begin : begin + len(numbers)] = 0.0
    inflated = max(inflation, decisions.LAW_FIRST_INFLATION)
    deviations = np.sqrt(np.maximum(np.diag(covariance)[len(rig) :], 0.0) * inflated) * sizes
    if fitted.shape.edge:  # its place is known no better than its width
        deviations[-2] = np.hypot(deviations[-2], numbers[-1])
    result = replace(
        fit,
        twin=make_twin(case.twin, clean, fit.effects, list_rig_parameters(case.twin)),
        estimates=widen_estimates(
            make_estimates(case, fit.effects, rig, clean, inflated * covariance), case, split.learn
        ),
        theta=clean,
        start_states=solved.start_states,
        power=solved.power,
        train=solved.misfit(case.noise),
        converged=solved.converged,
        choose=compute_left_out_misfit(solved.system, left_out, solved.counts, case.noise),
        window_squares=left_out,
        counts=solved.counts,
    )
    named = replace(fitted, values=numbers, deviations=deviations, curve=finer.get_values(clean))
    return result, named, finer


def _free_shape(
    theta: Floats, finer: Curve, fitted: FittedShape
) -> tuple[Floats, list[ShapeParameter]]:
    """Return theta (SIZE,) with a formula in its law's slot, and the formula's parameters."""
    shape, values, theta = fitted.shape, fitted.values, theta.copy()
    assert len(values) <= MOST_KNOTS - FORMULA_KNOTS
    finer.put(theta, np.zeros(FORMULA_KNOTS))
    at = LAWS + find_slot(theta, finer.kind) * LAW_SIZE + VALUES
    span, height = float(np.ptp(finer.knots)), _measure_height(finer, fitted)
    limits = (finer.low, LIMITS[finer.kind.role])
    knots = tuple(finer.knots.tolist())
    parameters = []
    for k, (name, value) in enumerate(zip(fitted.names, values, strict=True)):
        size = max(abs(float(value)), 1e-3 * (height if name in shape.factors else span))
        parameters.append(ShapeParameter(name, shape, knots, at, k, size, *limits))
    if shape.edge:  # its sides are values of the law, and between two knots nothing is sharper
        sharpest = EDGE_SOFT * float(np.ptp(finer.knots[:2]))
        lowest = (finer.low, finer.low, -np.inf, sharpest)
        parameters = [replace(p, low=low) for p, low in zip(parameters, lowest, strict=True)]
        values = np.maximum([*values[:-1], abs(values[-1])], lowest)
    theta[at + FORMULA_KNOTS : at + FORMULA_KNOTS + len(values)] = values
    parameters[0].put(theta, float(values[0]))
    return theta, parameters


def _sharpen(free: tuple[Free, ...]) -> tuple[Free, ...]:
    """Return the free parameters of an edge, whose width is the last, with a sharper edge."""
    return (*free[:-1], replace(free[-1], low=EDGE_SHARP / EDGE_SOFT * free[-1].low))


def _measure_height(curve: Curve, fitted: FittedShape) -> float:
    """Return the height of a formula in the unit of its law's quantity."""
    return max(float(np.ptp(fitted.curve)), curve.size)


def _hold_gauges(curve: Curve, fitted: FittedShape, sizes: Floats) -> Floats:
    """Return the penalty, (parameters, parameters), on the parts of a formula that others make.

    Without it the drive's constant and the mean of a gain make the same twin many times over.

    sizes: (parameters,) the formula's parameters are in units of these.
    """
    factors = len(fitted.shape.factors)
    columns = fitted.shape.draw_columns(curve.knots, fitted.values[factors:])
    shares = curve.gauges @ columns * sizes[:factors] / _measure_height(curve, fitted)
    penalty = np.zeros((len(sizes), len(sizes)))
    penalty[:factors, :factors] = GAUGE_WEIGHT * shares.T @ shares
    return penalty
