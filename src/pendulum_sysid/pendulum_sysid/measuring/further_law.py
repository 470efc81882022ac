"""Fit a law more beside what a fit holds: knots and smoothness follow what the law shows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.finding.judge import Lead, compute_lead
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.gauss_newton import scale_values
from pendulum_sysid.measuring.curve import Curve, refine_knots
from pendulum_sysid.measuring.penalised_fit import LawFit, fit_laws, list_all_free, list_parts
from pendulum_sysid.measuring.ranking import Ranked, reduce_to_last
from pendulum_sysid.measuring.smoothness import Smoothness, choose_smoothness
from pendulum_sysid.records import Fit, Split
from pendulum_twin.laws.law import locate_on_knots, make_curve_matrix


def fit_longer(case: Case, split: Split, law_fit: LawFit, candidate: Ranked) -> LawFit:
    """Return the fit with one law more, with its lead over the fit without."""
    return finish_longer(case, split, begin_longer(case, split, law_fit, candidate), law_fit)


def begin_longer(case: Case, split: Split, law_fit: LawFit, candidate: Ranked) -> LawFit:
    """Return the first fit with one law more; its smoothness is chosen where it has settled.

    The fit begins where the law is nothing, with the errors of the fit without the law.

    Knots are doubled as long as the law's effective parameters are about as many: such a curve
    cannot show all that the recording holds, and another recording asks between its knots (Wood,
    Generalized Additive Models (2017), section 5.9).
    """
    curve, prior = candidate.curve, candidate.prior
    theta = law_fit.fit.theta.copy()
    curve.put(theta, np.zeros(len(curve.knots)))
    start = replace(law_fit.fit, theta=theta)
    while True:
        curves, priors = (*law_fit.curves, curve), (*law_fit.priors, prior)
        begun = fit_laws(
            case,
            split,
            start,
            curves,
            priors,
            law_fit.inflation,
            least_gain=decisions.LAW_FIRST_GAIN,
        )
        priors = tuple(_choose_again(case, begun, k) for k in range(len(curves)))
        is_full = priors[-1].effective > decisions.LAW_MOST_EFFECTIVE * len(curve.knots)
        finer = refine_knots(curve) if is_full else None
        if finer is None:
            return replace(begun, priors=priors)
        start, prior = _refine(begun, finer, priors[-1])
        curve = finer


def finish_longer(case: Case, split: Split, begun: LawFit, shorter: LawFit) -> LawFit:
    """Return the fit with one law more, from its first fit (`begin_longer`), with its lead.

    shorter: the fit without the law.
    """
    longer = fit_laws(
        case, split, begun.fit, begun.curves, begun.priors, begun.inflation, begun.system
    )
    lead: Lead = compute_lead(longer.fit, shorter.fit)
    return replace(longer, lead=lead)


def _refine(begun: LawFit, finer: Curve, prior: Smoothness) -> tuple[Fit, Smoothness]:
    """Return the fit with its last law on finer knots, and the smoothness there.

    prior: on the knots of the fit.
    """
    curve, theta = begun.curves[-1], begun.fit.theta.copy()
    (steps,) = np.diff(locate_on_knots(curve.kind, finer.knots, curve.knots[:2]))
    spread = make_curve_matrix(curve.kind, curve.knots, finer.knots)
    if curve.kind.remembers:
        spread = spread / steps  # each element has its share of what slips
    finer.put(theta, spread @ begun.values[-1])
    return replace(begun.fit, theta=theta), replace(prior, length=prior.length * steps)


def _choose_again(case: Case, law_fit: LawFit, which: int) -> Smoothness:
    """Return the smoothness of one law of a fit, chosen where the fit ended."""
    assert law_fit.system is not None
    curves, theta = law_fit.curves, law_fit.fit.theta
    free = list_all_free(case, law_fit.fit.effects, theta, curves)
    parts = list_parts(len(free), curves)
    order = [k for k in range(len(curves)) if k != which] + [which]
    columns = [
        *range(parts[0].start),
        *(c for k in order for c in range(*parts[k].indices(len(free)))),
    ]
    matrix, gradient = reduce_to_last(
        law_fit.system.normal[np.ix_(columns, columns)],
        law_fit.system.gradient[columns],
        scale_values([free[c] for c in columns], theta),
        [curves[k] for k in order],
        [law_fit.priors[k] for k in order[:-1]],
        law_fit.inflation,
    )
    curve = curves[which]
    values = curve.get_values(theta) / curve.size
    return choose_smoothness(curve, matrix, gradient + matrix @ values, law_fit.inflation)
