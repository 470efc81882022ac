"""Fit rig, effects and measured laws together, the laws held smooth by their priors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.finding.judge import Lead
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.cross_validation import compute_left_out_misfit, cross_validate
from pendulum_sysid.fitting.fit import estimate_located, widen_estimates
from pendulum_sysid.fitting.gauss_newton import CONVERGED, complete_system, solve
from pendulum_sysid.fitting.linearised import System
from pendulum_sysid.fitting.parameters import (
    Free,
    list_free_parameters,
    list_rig_parameters,
    make_estimate,
    make_twin,
)
from pendulum_sysid.fitting.windows import shorten_windows
from pendulum_sysid.measuring.curve import Curve, find_slot
from pendulum_sysid.measuring.smoothness import Smoothness, make_precision
from pendulum_sysid.records import Estimate, Fit, Split
from pendulum_twin.arrays import Floats

ITERATIONS = 12
BLIND = 1e-14  # of the largest power, below which nothing fixes a direction


@dataclass(frozen=True)
class LawFit:
    """Hold a fit of rig, effects and measured laws.

    fit: as of any other set of effects; its twin holds the laws.
    curves: the laws, in the order in which they were added.
    priors: of the curves.
    values: of each curve, (knots,).
    covariances: of the values of each curve, (knots, knots), the remainder counted in.
    inflation: by which correlated errors widen intervals (a ratio of variances).
    system: the normal equations where the fit ended, without the priors; None before the first
        law.
    lead: over the fit without the last curve, on windows left out; None for none.
    """

    fit: Fit
    curves: tuple[Curve, ...]
    priors: tuple[Smoothness, ...]
    values: tuple[Floats, ...]
    covariances: tuple[Floats, ...]
    inflation: float
    system: System | None = None
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
    start: Fit,
    curves: tuple[Curve, ...],
    priors: tuple[Smoothness, ...],
    inflation: float,
    known: System | None = None,
    least_gain: float = CONVERGED,
) -> LawFit:
    """Return the fit of all parameters, cross-validated.

    start: from which the fit starts; its theta holds every curve.
    known: the normal equations there, without the priors; None where they are to be computed.
    least_gain: of an iteration, in nats a sample; a smaller gain ends the fit.
    """
    effects, pieces = start.effects, start.pieces
    problem = case.problem(shorten_windows(case.state, split.learn, pieces))
    free = list_all_free(case, effects, start.theta, curves)
    own = len(free) - sum(len(curve.knots) for curve in curves)
    precision = make_penalty(len(free), curves, priors, inflation)
    begun = solve(
        problem, start.theta, free, start.start_states, ITERATIONS, precision, known, least_gain
    )
    solved = complete_system(problem, begun, free)
    system = solved.system
    assert system is not None
    scatter = _measure_inflation(system, precision, pieces)
    covariance = scatter * invert_normal(system.normal + precision * (scatter / inflation))
    left_out = cross_validate(problem, solved, free, pieces, precision)
    sizes = np.array([parameter.size for parameter in free])
    fit = Fit(
        twin=make_twin(case.twin, solved.theta, effects, list_rig_parameters(case.twin)),
        effects=effects,
        estimates=widen_estimates(
            make_estimates(case, effects, free[:own], solved.theta, covariance), case, split.learn
        ),
        theta=solved.theta,
        start_states=solved.start_states,
        power=solved.power,
        train=solved.misfit(case.noise),
        choose=compute_left_out_misfit(system, left_out, solved.counts, case.noise),
        window_squares=left_out,
        counts=solved.counts,
        noise=case.noise,
        pieces=pieces,
        converged=solved.converged,
    )
    parts = list_parts(len(free), curves)
    return LawFit(
        fit,
        curves,
        priors,
        tuple(curve.get_values(solved.theta) for curve in curves),
        tuple(covariance[part, part] * np.outer(sizes[part], sizes[part]) for part in parts),
        scatter,
        system,
    )


def invert_normal(normal: Floats) -> Floats:
    """Return the inverse (parameters, parameters) of a normal matrix.

    The variance of a parameter that nothing fixes is infinite.
    """
    values, vectors = np.linalg.eigh(normal)
    blind = values < BLIND * max(values.max(), np.finfo(float).tiny)
    inverse: Floats = (vectors / np.where(blind, np.inf, values)) @ vectors.T
    np.fill_diagonal(inverse, np.where(vectors**2 @ blind > 1e-6, np.inf, np.diag(inverse)))
    return inverse


def make_penalty(
    count: int, curves: Sequence[Curve], priors: Sequence[Smoothness], inflation: float
) -> Floats:
    """Return the penalty (parameters, parameters) of the priors on a fit with laws.

    count: of all free parameters; the last are the values of the curves, and the others have no
        prior here.
    priors: of the first of the curves; curves without a prior are free.
    inflation: as of `LawFit`.
    """
    penalty = np.zeros((count, count))
    for curve, prior, part in zip(curves, priors, list_parts(count, curves), strict=False):
        penalty[part, part] = inflation * make_precision(curve, prior)
    return penalty


def _measure_inflation(system: System, precision: Floats, pieces: int) -> float:
    """Return by how much windows scatter more than independent errors would (variances)."""
    scores = system.scores.reshape(-1, pieces, system.scores.shape[1]).sum(axis=1)
    inverse = np.linalg.pinv(system.normal + precision, rcond=1e-12, hermitian=True)
    seen = float(np.sum(inverse * (scores.T @ scores)))
    expected = float(np.sum(inverse * system.normal))
    return float(np.clip(seen / max(expected, 1e-300), 1.0, decisions.LAW_MOST_INFLATION))


def list_parts(count: int, curves: Sequence[Curve]) -> list[slice]:
    """Return where the values of each curve lie among `count` free parameters."""
    begins = count - np.cumsum([len(curve.knots) for curve in reversed(curves)])[::-1]
    return [slice(int(a), int(a) + len(c.knots)) for a, c in zip(begins, curves, strict=True)]


def make_estimates(
    case: Case, effects: tuple[str, ...], free: tuple[Free, ...], theta: Floats, covariance: Floats
) -> dict[str, Estimate]:
    """Return value and 95 % interval of parameters, times that were read off included.

    covariance: of the free parameters, in units of their sizes.
    """
    estimates = estimate_located(case, effects, theta)
    for k, parameter in enumerate(free):
        half = decisions.INTERVAL_DEVIATIONS * float(np.sqrt(max(covariance[k, k], 0.0)))
        half *= parameter.size
        estimates[parameter.name] = make_estimate(parameter, parameter.get(theta), half)
    return estimates
