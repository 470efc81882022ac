"""Measure laws where physics has no name: rank all kinds, fit the best, keep what the judge keeps.

Every kind of law that the recording can show is tried by a score test: one linearised step, the
rig and all effects following, with the curve's own smoothness. The likeliest few are fitted in
full. A law stays if windows left out are better for it, as for a name.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag

from pendulum_sysid import decisions
from pendulum_sysid.finding.judge import Lead, compute_lead
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.fit import HORIZONS, fit
from pendulum_sysid.fitting.gauss_newton import refine_start_states
from pendulum_sysid.fitting.linearised import linearise
from pendulum_sysid.fitting.windows import shorten_windows
from pendulum_sysid.measuring.curve import Curve, list_curves
from pendulum_sysid.measuring.naming import name_curves
from pendulum_sysid.measuring.penalised_fit import LawFit, fit_laws, list_all_free
from pendulum_sysid.measuring.smoothness import (
    Smoothness,
    choose_smoothness,
    eliminate,
    make_precision,
)
from pendulum_sysid.records import Fit, Split
from pendulum_twin.arrays import Floats
from pendulum_twin.laws.kind import Variable

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Ranked:
    """Hold a curve that may explain what remains, with its values by one linearised step.

    prior: chosen for it; its evidence ranks it.
    values: (knots,) in the unit of its quantity.
    """

    curve: Curve
    prior: Smoothness
    values: Floats


def measure_best_laws(
    case: Case, split: Split, starts: Sequence[Fit], report: Progress
) -> LawFit | None:
    """Return the fit with measured laws from the first start that leaves noise, or the best.

    starts: fits without laws, the simplest first. A start whose first law explains less than the
        effects of the last start is given up.
    """
    best: LawFit | None = None
    named = _begin(case, split, starts[-1]).fit
    for start in {start.effects: start for start in starts}.values():
        law_fit = measure_laws(case, split, start, report, named.choose)
        if law_fit is None:
            continue
        if best is None or compute_lead(law_fit.fit, best.fit).is_real:
            best = law_fit
        if name_curves(case, split, best)[0].choose <= decisions.MISFIT_AT_NOISE:
            break
    if best is None:
        return None
    return best if compute_lead(best.fit, named).is_real else None


def measure_laws(
    case: Case, split: Split, start: Fit, report: Progress, most: float = np.inf
) -> LawFit | None:
    """Return the fit with measured laws beside the effects of a fit; None where no law helps.

    start: the fit with the effects that were named so far, and no laws.
    most: misfit, in units of noise, that the first law may leave for a second law to be measured.
    """
    law_fit = _begin(case, split, start)
    while len(law_fit.curves) < decisions.LAWS_MEASURED:
        longer = _add_law(case, split, law_fit, report)
        if longer is None:
            break
        law_fit = longer
        if law_fit.fit.choose > most:
            break
        # a sharp edge needs its formula to end at the noise: no second law may mend it
        if name_curves(case, split, law_fit)[0].choose <= decisions.MISFIT_AT_NOISE:
            break
    return law_fit if law_fit.curves else None


def _begin(case: Case, split: Split, start: Fit) -> LawFit:
    """Return a fit without laws over the short horizon, where errors stay where they arise."""
    pieces = HORIZONS[0]
    if start.pieces != pieces:
        start = fit(case, split, start.effects, start.theta, pieces)
    return LawFit(start, (), (), (), (), decisions.LAW_FIRST_INFLATION)


def _add_law(case: Case, split: Split, law_fit: LawFit, report: Progress) -> LawFit | None:
    """Return the fit with the law that helps most; None where none helps for sure."""
    ranked = rank_curves(case, split, law_fit)
    kept: list[LawFit] = []
    for candidate in ranked[: decisions.LAWS_REFITTED]:
        if candidate.prior.evidence < decisions.LAW_EVIDENCE_SHARE * ranked[0].prior.evidence:
            break
        try:
            longer = _fit_longer(case, split, law_fit, candidate)
        except np.linalg.LinAlgError:
            continue
        report(
            f"{candidate.curve.kind.name}: misfit {law_fit.fit.choose:.2f} becomes "
            f"{longer.fit.choose:.2f} ({candidate.prior.evidence:.0f} nats)"
        )
        if _is_kept(case, split, longer, law_fit):
            kept.append(longer)
            if longer.fit.choose <= decisions.MISFIT_AT_NOISE:
                break
    return min(kept, key=lambda longer: longer.fit.choose, default=None)


def _is_kept(case: Case, split: Split, longer: LawFit, law_fit: LawFit) -> bool:
    """Return whether the last law is surely worth its place, over both horizons."""
    if longer.lead is None or not longer.lead.is_real:
        return False
    if not _is_of_rig(case, split, longer):
        return False
    whole = [
        refine_start_states(case.problem(split.learn), fit.theta).misfit(case.noise)
        for fit in (longer.fit, law_fit.fit)
    ]
    return whole[0] < whole[1]


def _is_of_rig(case: Case, split: Split, law_fit: LawFit) -> bool:
    """Return whether every curve over time has a formula.

    A free curve over time takes whatever one recording leaves, instant by instant, and would be
    played back in the next; a formula over time (a rig that warms up) may hold there again.
    """
    over_time = [k for k, c in enumerate(law_fit.curves) if c.kind.variable is Variable.TIME]
    if not over_time:
        return True
    _, named = name_curves(case, split, law_fit)
    return all(named[k].shape is not None for k in over_time)


def _fit_longer(case: Case, split: Split, law_fit: LawFit, candidate: Ranked) -> LawFit:
    """Return the fit with one law more; its smoothness is chosen again where the fit ended."""
    theta = law_fit.fit.theta.copy()
    candidate.curve.put(theta, candidate.values)
    curves, priors = (*law_fit.curves, candidate.curve), (*law_fit.priors, candidate.prior)
    arguments = (case, split, law_fit.fit.effects)
    first = fit_laws(
        *arguments,
        theta,
        curves,
        priors,
        law_fit.inflation,
        law_fit.fit.pieces,
        law_fit.fit.start_states,
    )
    priors = tuple(
        _choose_again(case, split, first, k, first.inflation) for k in range(len(curves))
    )
    second = fit_laws(
        *arguments,
        first.fit.theta,
        curves,
        priors,
        first.inflation,
        law_fit.fit.pieces,
        first.fit.start_states,
    )
    lead: Lead = compute_lead(second.fit, law_fit.fit)
    return replace(second, lead=lead)


def _choose_again(
    case: Case, split: Split, law_fit: LawFit, which: int, inflation: float
) -> Smoothness:
    """Return the smoothness of one law of a fit, chosen where the fit ended."""
    order = [k for k in range(len(law_fit.curves)) if k != which] + [which]
    curves = tuple(law_fit.curves[k] for k in order)
    priors = tuple(law_fit.priors[k] for k in order)
    matrix, gradient = _reduce(case, split, law_fit.fit, curves, priors[:-1], inflation)
    curve = curves[-1]
    values = curve.get_values(law_fit.fit.theta) / curve.size
    return choose_smoothness(curve, matrix, gradient + matrix @ values, inflation)


def rank_curves(case: Case, split: Split, law_fit: LawFit) -> list[Ranked]:
    """Return the curves that make the recording likelier, the likeliest first."""
    known = {curve.kind for curve in law_fit.curves}
    ranked = []
    for curve in list_curves(case, law_fit.fit.theta, law_fit.fit.effects):
        if curve.kind in known:
            continue
        theta = law_fit.fit.theta.copy()
        curve.put(theta, np.zeros(len(curve.knots)))
        start = replace(law_fit.fit, theta=theta)
        matrix, gradient = _reduce(
            case, split, start, (*law_fit.curves, curve), law_fit.priors, law_fit.inflation
        )
        prior = choose_smoothness(curve, matrix, gradient, law_fit.inflation)
        if prior.evidence < decisions.LAW_LEAST_NATS:
            continue
        penalty = law_fit.inflation * make_precision(curve, prior)
        values = curve.size * np.linalg.solve(matrix + penalty, gradient)
        ranked.append(Ranked(curve, prior, np.clip(values, curve.low, None)))
    return sorted(ranked, key=lambda candidate: -candidate.prior.evidence)


def _reduce(
    case: Case,
    split: Split,
    start: Fit,
    curves: tuple[Curve, ...],
    priors: tuple[Smoothness, ...],
    inflation: float,
) -> tuple[Floats, Floats]:
    """Return matrix and gradient of the last curve's values at a fit, all else following.

    start: its theta holds all curves.
    priors: of all curves but the last.
    """
    free = list_all_free(case, start.effects, start.theta, curves)
    problem = case.problem(shorten_windows(case.state, split.learn, start.pieces))
    system = linearise(problem, start.theta, start.start_states, free, start.power)
    last = len(curves[-1].knots)
    own = len(free) - sum(len(curve.knots) for curve in curves)
    precision = inflation * block_diag(
        np.zeros((own, own)),
        *(make_precision(c, p) for c, p in zip(curves[:-1], priors, strict=True)),
        np.zeros((last, last)),
    )
    scaled = np.array([parameter.get(start.theta) / parameter.size for parameter in free])
    return eliminate(system.normal + precision, system.gradient - precision @ scaled, last)
