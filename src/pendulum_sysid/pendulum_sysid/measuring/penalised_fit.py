"""Fit rig, effects and measured laws together, the laws held smooth by their priors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from pendulum_sysid import decisions
from pendulum_sysid.finding.judge import Lead
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.cross_validation import (
    compute_left_out_misfit,
    cross_validate,
    penalise,
)
from pendulum_sysid.fitting.fit import estimate_located
from pendulum_sysid.fitting.gauss_newton import (
    CONVERGED,
    Solution,
    compute_cost,
    compute_power,
    measure_belief,
    take_step,
)
from pendulum_sysid.fitting.linearised import Problem, System, compute_errors, linearise
from pendulum_sysid.fitting.parameters import (
    Free,
    list_free_parameters,
    list_rig_parameters,
    make_twin,
)
from pendulum_sysid.fitting.windows import gather, shorten_windows
from pendulum_sysid.measuring.curve import Curve, find_slot
from pendulum_sysid.measuring.smoothness import Smoothness, make_precision
from pendulum_sysid.records import Estimate, Fit, Split
from pendulum_twin.arrays import Floats

ITERATIONS = 12


@dataclass(frozen=True)
class LawFit:
    """Hold a fit of rig, effects and measured laws.

    fit: as of any other set of effects; its twin holds the laws.
    curves: the laws, in the order in which they were added.
    priors: of the curves.
    values: of each curve, (knots,).
    covariances: of the values of each curve, (knots, knots), the remainder counted in.
    inflation: by which errors that hang together widen intervals (a ratio of variances).
    lead: over the fit without the last curve, on windows left out; None for none.
    """

    fit: Fit
    curves: tuple[Curve, ...]
    priors: tuple[Smoothness, ...]
    values: tuple[Floats, ...]
    covariances: tuple[Floats, ...]
    inflation: float
    lead: Lead | None = None


def list_all_free(
    case: Case, effects: tuple[str, ...], theta: Floats, curves: tuple[Curve, ...]
) -> tuple[Free, ...]:
    """Return the free parameters of a fit: rig, effects, then the values of each curve."""
    laws = [free for curve in curves for free in curve.list_free(find_slot(theta, curve.kind))]
    return (*list_free_parameters(case.twin, effects, case.scales), *laws)


def fit_laws(
    case: Case,
    split: Split,
    effects: tuple[str, ...],
    theta: Floats,
    curves: tuple[Curve, ...],
    priors: tuple[Smoothness, ...],
    inflation: float,
    pieces: int,
    start_states: Floats | None = None,
) -> LawFit:
    """Return the fit of all parameters, cross-validated, from theta (SIZE,).

    theta: holds every curve.
    pieces: how many pieces each window is cut into.
    start_states: (windows * pieces, 4) of a nearby fit; None for none.
    """
    problem = case.problem(shorten_windows(case.state, split.learn, pieces))
    free = list_all_free(case, effects, theta, curves)
    own = len(free) - sum(len(curve.knots) for curve in curves)
    precision = inflation * block_diag(
        np.zeros((own, own)),
        *(make_precision(c, p) for c, p in zip(curves, priors, strict=True)),
    )
    solved = minimise(problem, theta, free, precision, start_states)
    system, squares, counts = solved.system, solved.squares, solved.counts
    scatter = _measure_inflation(system, precision, pieces)
    covariance = scatter * np.linalg.pinv(
        system.normal + precision * (scatter / inflation), rcond=1e-14, hermitian=True
    )
    left_out = cross_validate(problem, solved.solution, free, pieces, precision)
    power = compute_power(squares, counts)
    sizes = np.array([parameter.size for parameter in free])
    fit = Fit(
        twin=make_twin(case.twin, solved.theta, effects, list_rig_parameters(case.twin)),
        effects=effects,
        estimates=make_estimates(case, effects, free[:own], solved.theta, covariance),
        theta=solved.theta,
        start_states=solved.start_states,
        power=power,
        train=float(np.exp(0.5 * np.mean(np.log(power / case.noise**2)))),
        choose=compute_left_out_misfit(system, left_out, counts, case.noise),
        window_squares=left_out,
        counts=counts,
        noise=case.noise,
        pieces=pieces,
        converged=solved.converged,
    )
    parts = _list_parts(own, curves)
    return LawFit(
        fit,
        curves,
        priors,
        tuple(curve.get_values(solved.theta) for curve in curves),
        tuple(covariance[part, part] * np.outer(sizes[part], sizes[part]) for part in parts),
        scatter,
    )


@dataclass(frozen=True)
class Minimum:
    """Hold where a penalised fit ended; system: the normal equations there, without penalty."""

    theta: Floats
    start_states: Floats
    squares: Floats
    counts: Floats
    system: System
    converged: bool

    @property
    def power(self) -> Floats:
        """Return each channel's mean squared error."""
        return compute_power(self.squares, self.counts)

    @property
    def solution(self) -> Solution:
        """Return the minimum as a solution of the fit without a penalty."""
        return Solution(
            self.theta, self.start_states, self.squares, self.counts, self.converged, self.system
        )


def minimise(
    problem: Problem,
    theta: Floats,
    free: tuple[Free, ...],
    precision: Floats,
    start_states: Floats | None,
    iterations: int = ITERATIONS,
) -> Minimum:
    """Minimise the cost of `gauss_newton.solve` with a penalty on the parameters' sizes."""
    windows = problem.windows
    starts = windows.start_states.copy() if start_states is None else start_states.copy()
    _, weights = gather(problem.signals, windows.begin, windows.samples)
    counts = weights.sum(axis=1)
    sizes = np.array([parameter.size for parameter in free])

    def scale_values(theta: Floats) -> Floats:
        return np.array([parameter.get(theta) for parameter in free]) / sizes

    def measure(theta: Floats, starts: Floats) -> tuple[Floats, float]:
        with np.errstate(all="ignore"):
            squares = np.sum(compute_errors(problem, theta, starts) ** 2, axis=1)
        scaled = scale_values(theta)
        penalty = float(scaled @ precision @ scaled) / (2 * float(counts.sum()))
        believed = measure_belief(free, theta)
        return squares, compute_cost(problem, starts, squares, counts, believed) + penalty

    squares, cost = measure(theta, starts)
    damping, converged = 1e-6, False
    system = linearise(problem, theta, starts, free, compute_power(squares, counts))
    for _ in range(iterations):
        pulled = penalise(system, theta, free, precision)
        while True:
            new_theta, new_starts = take_step(pulled, theta, starts, free, damping)
            new_squares, new_cost = measure(new_theta, new_starts)
            if new_cost < cost or damping > 1e4:
                break
            damping = max(damping * 10, 1e-3)
        if not new_cost < cost:
            converged = True
            break
        gain, cost = cost - new_cost, new_cost
        theta, starts, squares = new_theta, new_starts, new_squares
        damping = max(damping * 0.1, 1e-9)
        system = linearise(problem, theta, starts, free, compute_power(squares, counts))
        if gain < CONVERGED:
            converged = True
            break
    return Minimum(theta, starts, squares, counts, system, converged)


def _measure_inflation(system: System, precision: Floats, pieces: int) -> float:
    """Return by how much windows scatter more than independent errors would (variances)."""
    scores = system.scores.reshape(-1, pieces, system.scores.shape[1]).sum(axis=1)
    inverse = np.linalg.pinv(system.normal + precision, rcond=1e-12, hermitian=True)
    seen = float(np.sum(inverse * (scores.T @ scores)))
    expected = float(np.sum(inverse * system.normal))
    return float(np.clip(seen / max(expected, 1e-300), 1.0, decisions.LAW_MOST_INFLATION))


def _list_parts(own: int, curves: tuple[Curve, ...]) -> list[slice]:
    """Return where the values of each curve lie among the free parameters."""
    ends = own + np.cumsum([len(curve.knots) for curve in curves])
    return [slice(int(e) - len(c.knots), int(e)) for e, c in zip(ends, curves, strict=True)]


def make_estimates(
    case: Case, effects: tuple[str, ...], free: tuple[Free, ...], theta: Floats, covariance: Floats
) -> dict[str, Estimate]:
    """Return value and 95 % interval of parameters, times that were read off included.

    covariance: of the free parameters, in units of their sizes.
    """
    estimates = estimate_located(case, effects, theta)
    for k, parameter in enumerate(free):
        value = parameter.get(theta)
        half = decisions.INTERVAL_DEVIATIONS * float(np.sqrt(max(covariance[k, k], 0.0)))
        half *= parameter.size
        bound = value <= parameter.low or value >= parameter.high
        fixed = half < max(abs(value), parameter.size) and not bound
        low, high = max(value - half, parameter.low), min(value + half, parameter.high)
        estimates[parameter.name] = Estimate(value, low, high, fixed, bound)
    return estimates
