"""Measure laws where physics has no name: rank all kinds, fit the best, keep what the judge keeps.

Every kind of law that the recording can show is tried by a score test: one linearised step, the
rig and all effects following, with the curve's own smoothness. The likeliest few get a first fit,
and the best of these are fitted to their end. A law stays if windows left out are better for it,
as for a name.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.finding.judge import compute_lead, judge_over_whole_windows
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.fit import HORIZONS, fit_over_horizon
from pendulum_sysid.measuring.curve import find_slot
from pendulum_sysid.measuring.further_law import begin_longer, finish_longer
from pendulum_sysid.measuring.halves import is_seen_in_halves
from pendulum_sysid.measuring.naming import NamedCurve, name_curves
from pendulum_sysid.measuring.penalised_fit import LawFit, fit_laws
from pendulum_sysid.measuring.ranking import rank_curves
from pendulum_sysid.records import Fit, Split
from pendulum_twin.laws.kind import Variable
from pendulum_twin.parameter_vector import list_law_kinds, take_law_out

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Measured:
    """Hold a fit with measured laws, and what their curves are named.

    stood_for: kinds of laws for which effects stood that the fit begins without; each gets a first
        fit as the next law.
    is_complete: whether no law follows. A curve over time goes then if it has no formula, so it
        is asked for its formula again, before all other curves.
    """

    case: Case
    split: Split
    law_fit: LawFit
    stood_for: frozenset[str] = frozenset()
    is_complete: bool = False

    @cached_property
    def named(self) -> tuple[Fit, tuple[NamedCurve, ...]]:
        """Return the fit with formulas in place of curves, and the curves (`name_curves`)."""
        fit, named = name_curves(self.case, self.split, self.law_fit)
        if self.is_complete and any(named[k].shape is None for k in list_over_time(self)):
            return name_curves(self.case, self.split, self.law_fit, time_first=True)
        return fit, named

    @cached_property
    def over_whole_windows(self) -> Fit:
        """Return the fit with formulas, with its errors over whole windows, nothing refitted."""
        return judge_over_whole_windows(self.case, self.split, self.named[0])

    @property
    def kinds(self) -> tuple[str, ...]:
        """Return the kinds of the laws."""
        return tuple(curve.kind.name for curve in self.law_fit.curves)

    @property
    def effects(self) -> tuple[str, ...]:
        """Return the effects beside the laws."""
        return self.law_fit.fit.effects

    @property
    def is_at_noise(self) -> bool:
        """Return whether the fit ends at the noise: a sharp edge needs its formula for that."""
        return self.named[0].choose <= decisions.MISFIT_AT_NOISE


def measure_laws(
    case: Case,
    split: Split,
    begun: LawFit,
    report: Progress,
    most: float = np.inf,
    stood_for: frozenset[str] = frozenset(),
) -> Measured | None:
    """Return the fit with measured laws beside the effects of a fit; None where no law helps.

    One curve over time may wait for its formula until the other laws are measured: what they would
    explain clouds its shape. Where no formula comes, or the other laws do as well without the
    curve, the curve goes, and laws are measured on from the others without waiting.

    begun: the fit with the effects that were named so far, and no laws.
    most: misfit, in units of noise, that the first law may leave for a second law to be measured.
    stood_for: see `Measured`.
    """
    start = Measured(case, split, begun, stood_for)
    measured = replace(_add_laws(start, report, most, most_waiting=1), is_complete=True)
    idle = _list_idle_over_time(measured)
    if idle:
        others = leave_curves_out(measured, idle)
        lead = compute_lead(others.law_fit.fit, begun.fit)
        helps = lead.is_real and is_seen_in_halves(case, split, others.law_fit, begun)
        begin = replace(others, is_complete=False) if helps else start
        measured = _add_laws(begin, report, most, most_waiting=0)
    return measured if measured.law_fit.curves else None


def add_small_laws(measured: Measured, report: Progress) -> Measured:
    """Return the fit with further laws whose leads are sure but small, if they end at the noise.

    Beside what a model leaves out a small lead says nothing. Where several laws together leave
    nothing, and together have the lead of a name, each of them counts.
    """
    longer = measured
    while len(list_law_kinds(longer.law_fit.fit.theta)) < decisions.LAWS_MEASURED:
        further = _add_law(longer, report, most_waiting=0, small=True)
        if further is None:
            break
        longer = further
        if longer.is_at_noise:
            lead = compute_lead(longer.law_fit.fit, measured.law_fit.fit)
            return longer if lead.is_real else measured
    return measured


def _add_laws(measured: Measured, report: Progress, most: float, most_waiting: int) -> Measured:
    """Return the fit with law after law, as long as a law helps.

    A law that a later law makes needless goes. A curve over time that has its formula does not
    wait again: no later law may take it away.

    most_waiting: number of curves over time that may stay without a formula.
    """
    for _ in range(2 * decisions.LAWS_MEASURED):  # each may make an earlier law needless
        if len(list_law_kinds(measured.law_fit.fit.theta)) >= decisions.LAWS_MEASURED:
            break
        if measured.law_fit.curves and _is_of_rig(measured):
            if measured.is_at_noise:
                break
            if list_over_time(measured):
                most_waiting = 0
        longer = _add_law(measured, report, most_waiting)
        if longer is None:
            break
        needless = _list_needless(longer.law_fit)
        measured = leave_curves_out(longer, needless) if needless else longer
        if measured.law_fit.fit.choose > most:
            break
    return measured


def _list_needless(law_fit: LawFit) -> list[int]:
    """Return the earlier curves for which there is less evidence now than starts a fit."""
    earlier = law_fit.priors[:-1]
    return [k for k, prior in enumerate(earlier) if prior.evidence < decisions.LAW_LEAST_NATS]


def drop_needless(measured: Measured, kinds: Sequence[str]) -> Measured:
    """Return the fit without the laws that it does as well without, the least likely first.

    kinds: of the laws that are asked.
    """
    priors = dict(zip(measured.kinds, measured.law_fit.priors, strict=True))
    for kind in sorted(kinds, key=lambda kind: priors[kind].evidence):
        less = leave_curves_out(measured, [measured.kinds.index(kind)])
        if not compute_lead(measured.law_fit.fit, less.law_fit.fit).is_real:
            measured = less
    return measured


def begin_without_laws(case: Case, split: Split, start: Fit) -> LawFit:
    """Return a fit without new laws over the short horizon, where errors stay where they arise.

    Where the short horizon shows no errors, the fit is over the long horizon, where small errors
    add up.
    """
    begun = fit_without_laws(case, split, start, HORIZONS[0])
    if begun.fit.choose <= decisions.MISFIT_AT_NOISE:
        begun = fit_without_laws(case, split, start, HORIZONS[-1])
    return begun


def fit_without_laws(case: Case, split: Split, start: Fit, pieces: int) -> LawFit:
    """Return the fit without laws over a horizon; pieces: of each window."""
    fit = fit_over_horizon(case, split, start, pieces)
    return LawFit(fit, (), (), (), (), decisions.LAW_FIRST_INFLATION)


def _add_law(
    measured: Measured, report: Progress, most_waiting: int, small: bool = False
) -> Measured | None:
    """Return the fit with the law that helps most; None where none helps for sure.

    The likeliest laws get a first fit, and the laws for which effects stood. Best first, fits are
    finished, and finished fits are asked whether they stay. A first fit at the noise comes before
    another law is tried.
    """
    case, split, law_fit = measured.case, measured.split, measured.law_fit
    ranked = rank_curves(case, split, law_fit)
    likeliest = ranked[: decisions.LAWS_REFITTED]
    others = ranked[decisions.LAWS_REFITTED :]
    likeliest += [other for other in others if other.curve.kind.name in measured.stood_for]
    tried: list[LawFit] = []
    for candidate in likeliest:
        if candidate.prior.evidence < decisions.LAW_EVIDENCE_SHARE * ranked[0].prior.evidence:
            break
        try:
            begun = begin_longer(case, split, law_fit, candidate)
        except np.linalg.LinAlgError:
            continue
        report(
            f"{candidate.curve.kind.name}: misfit {law_fit.fit.choose:.2f} becomes "
            f"{begun.fit.choose:.2f} ({candidate.prior.evidence:.0f} nats)"
        )
        if begun.fit.choose <= decisions.MISFIT_AT_NOISE:
            longer = _take_best(measured, [begun], most_waiting, small)
            if longer is not None:
                return longer
        else:
            tried.append(begun)
    return _take_best(measured, tried, most_waiting, small)


def _take_best(
    measured: Measured, tried: list[LawFit], most_waiting: int, small: bool
) -> Measured | None:
    """Return the best of the fits with a law more that is kept; None where none is.

    tried: first fits, and finished fits, which have a lead. Finishing a fit takes as long as all
        before, and seldom changes which is best.
    """
    case, split, shorter = measured.case, measured.split, measured.law_fit
    while tried:
        best = min(tried, key=lambda law_fit: law_fit.fit.choose)
        tried = [law_fit for law_fit in tried if law_fit is not best]
        if best.lead is None:
            with suppress(np.linalg.LinAlgError):
                tried.append(finish_longer(case, split, best, shorter))
            continue
        longer = Measured(case, split, best)
        if _is_kept(longer, shorter, most_waiting, small):
            return longer
    return None


def _is_kept(longer: Measured, shorter: LawFit, most_waiting: int, small: bool) -> bool:
    """Return whether the last law leads, holds in both halves and is of the rig."""
    lead = longer.law_fit.lead
    if lead is None or not (lead.is_sure if small else lead.is_real):
        return False
    lasts = is_seen_in_halves(longer.case, longer.split, longer.law_fit, shorter)
    return lasts and _is_of_rig(longer, most_waiting)


def _is_of_rig(measured: Measured, most_waiting: int = 0) -> bool:
    """Return whether every curve over time has a formula, but for so many curves that wait.

    A free curve over time takes whatever one recording leaves, instant by instant, and would be
    played back in the next; a formula over time (a rig that warms up) may hold there again.
    """
    over_time = list_over_time(measured)
    if len(over_time) <= most_waiting:
        return True
    return sum(measured.named[1][k].shape is None for k in over_time) <= most_waiting


def _list_idle_over_time(measured: Measured) -> list[int]:
    """Return the curves over time without a formula, or without which the fit is no worse.

    A curve that waited was judged before the other laws, and may have stood for them.
    """
    fit, named = measured.law_fit.fit, measured.named[1]
    return [
        k
        for k in list_over_time(measured)
        if named[k].shape is None
        or not compute_lead(fit, leave_curves_out(measured, [k]).law_fit.fit).is_real
    ]


def leave_curves_out(measured: Measured, which: Sequence[int]) -> Measured:
    """Return the fit without some of its curves, the others following."""
    law_fit = measured.law_fit
    theta = law_fit.fit.theta.copy()
    for k in which:
        take_law_out(theta, find_slot(theta, law_fit.curves[k].kind))
    others = [n for n in range(len(law_fit.curves)) if n not in which]
    start = replace(law_fit.fit, theta=theta)
    if not others:  # nothing may be left to fit
        bare = fit_without_laws(measured.case, measured.split, start, law_fit.fit.pieces)
        return replace(measured, law_fit=bare)
    less = fit_laws(
        measured.case,
        measured.split,
        start,
        tuple(law_fit.curves[n] for n in others),
        tuple(law_fit.priors[n] for n in others),
        law_fit.inflation,
    )
    return replace(measured, law_fit=less)


def list_over_time(measured: Measured) -> list[int]:
    """Return which of the curves are over time."""
    curves = measured.law_fit.curves
    return [k for k, curve in enumerate(curves) if curve.kind.variable is Variable.TIME]
