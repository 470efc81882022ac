"""Try curves to first order: a linearised step that all other parameters follow (score test).

Rao, Proc. Cambridge Phil. Soc. 44 (1948) 50.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.gauss_newton import scale_values
from pendulum_sysid.fitting.linearised import System, assemble
from pendulum_sysid.fitting.neighbours import NeighbourErrors, run_neighbours
from pendulum_sysid.fitting.parameters import Free
from pendulum_sysid.fitting.problem import Problem
from pendulum_sysid.fitting.windows import shorten_windows
from pendulum_sysid.measuring.curve import Curve, find_slot, list_curves
from pendulum_sysid.measuring.penalised_fit import LawFit, list_all_free, make_penalty
from pendulum_sysid.measuring.smoothness import (
    Smoothness,
    choose_smoothness,
    eliminate,
)
from pendulum_sysid.records import Split
from pendulum_twin.arrays import Floats
from pendulum_twin.laws.law import MOST_LAWS
from pendulum_twin.parameter_vector import list_law_kinds


@dataclass(frozen=True)
class Ranked:
    """Hold a curve that may explain what remains.

    prior: chosen for the curve to first order; its evidence ranks the curve.
    """

    curve: Curve
    prior: Smoothness


def rank_curves(case: Case, split: Split, law_fit: LawFit) -> list[Ranked]:
    """Return the curves that make the recording likelier, the likeliest first.

    A law that the given twin has stays as it is; where the twin can hold no more there are none.
    """
    ranked = [candidate for _, candidate, _ in _try_curves(case, split, law_fit)]
    return sorted(ranked, key=lambda candidate: -candidate.prior.evidence)


def step_to_curves(case: Case, split: Split, law_fit: LawFit) -> list[tuple[Ranked, Floats]]:
    """Return the curves of `rank_curves`, each with theta (SIZE,) after its linearised step.

    All other parameters follow the step.
    """
    steps = []
    for trial, candidate, system in _try_curves(case, split, law_fit):
        theta = law_fit.fit.theta.copy()
        slot = candidate.curve.put(theta, np.zeros(len(candidate.curve.knots)))
        free = (*trial.own, *candidate.curve.list_free(slot))
        curves, priors = (*law_fit.curves, candidate.curve), (*law_fit.priors, candidate.prior)
        precision = make_penalty(len(free), curves, priors, law_fit.inflation)
        gradient = system.gradient - precision @ scale_values(free, theta)
        step = np.linalg.lstsq(system.normal + precision, gradient, rcond=1e-12)[0]
        for parameter, change in zip(free, step, strict=True):
            value = parameter.get(theta) + change * parameter.size
            parameter.put(theta, float(np.clip(value, parameter.low, parameter.high)))
        steps.append((candidate, theta))
    return sorted(steps, key=lambda step: -step[0].prior.evidence)


@dataclass(frozen=True)
class _Trial:
    """Hold what all curves are tried against: a fit, its errors, and its free parameters."""

    law_fit: LawFit
    problem: Problem
    own: tuple[Free, ...]
    errors: NeighbourErrors


def _try_curves(
    case: Case, split: Split, law_fit: LawFit
) -> Iterator[tuple[_Trial, Ranked, System]]:
    """Yield every curve that makes the recording likelier, with the normal equations with it."""
    start = law_fit.fit
    known = list_law_kinds(start.theta)
    if len(known) >= MOST_LAWS:
        return
    trial = _begin_trial(case, split, law_fit)
    for curve in list_curves(case, start.theta, start.effects):
        tried = None if curve.kind in known else _try_curve(trial, curve)
        if tried is not None:
            yield trial, *tried


def _begin_trial(case: Case, split: Split, law_fit: LawFit) -> _Trial:
    start = law_fit.fit
    problem = case.problem(shorten_windows(case.state, split.learn, start.pieces))
    own = list_all_free(case, start.effects, start.theta, law_fit.curves)
    errors = run_neighbours(problem, start.theta, start.start_states, own, start.power)
    return _Trial(law_fit, problem, own, errors)


def _try_curve(trial: _Trial, curve: Curve) -> tuple[Ranked, System] | None:
    """Return a curve with its prior, chosen to first order, and the normal equations with it.

    None where the recording is not likelier with it.
    """
    law_fit, problem, start = trial.law_fit, trial.problem, trial.law_fit.fit
    theta = start.theta.copy()
    curve.put(theta, np.zeros(len(curve.knots)))
    knots = tuple(curve.list_free(find_slot(theta, curve.kind)))
    added = run_neighbours(problem, theta, start.start_states, knots, start.power)
    system = assemble(problem, start.start_states, trial.errors, added, summed=True)
    values = scale_values((*trial.own, *knots), theta)
    curves = (*law_fit.curves, curve)
    matrix, gradient = reduce_to_last(
        system.normal, system.gradient, values, curves, law_fit.priors, law_fit.inflation
    )
    prior = choose_smoothness(curve, matrix, gradient, law_fit.inflation)
    return (Ranked(curve, prior), system) if prior.evidence >= decisions.LAW_LEAST_NATS else None


def reduce_to_last(
    normal: Floats,
    gradient: Floats,
    values: Floats,
    curves: Sequence[Curve],
    priors: Sequence[Smoothness],
    inflation: float,
) -> tuple[Floats, Floats]:
    """Return matrix and gradient of the last curve's values, all else following.

    normal, gradient: (parameters, parameters) and (parameters,) the normal equations of all free
        parameters, without priors.
    values: (parameters,) where they were computed, in the parameters' sizes.
    priors: of all curves but the last.
    """
    precision = make_penalty(len(values), curves, priors, inflation)
    last = len(curves[-1].knots)
    return eliminate(normal + precision, gradient - precision @ values, last)
