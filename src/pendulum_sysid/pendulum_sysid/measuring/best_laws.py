"""Measure laws from several starts, and take the best: which effects stay beside the laws."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.finding.judge import compute_lead
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.measuring.measure import (
    Measured,
    Progress,
    add_small_laws,
    begin_without_laws,
    fit_without_laws,
    leave_curves_out,
    list_over_time,
    measure_laws,
)
from pendulum_sysid.measuring.penalised_fit import LawFit, fit_laws
from pendulum_sysid.records import Fit, Split
from pendulum_twin.effects import BY_NAME


@dataclass(frozen=True)
class Starts:
    """Hold the fits without laws from which laws begin.

    fits: the simplest first. A start whose first law explains less than the effects of the last
        start is given up.
    names: effects of the last start that are names (`is_better`).
    cancelled: effects that take each other back (`is_better`).
    without_doubtful: fit without the effects that may be there, from which laws begin where no law
        helps beside them: what such an effect stands for bars the right law.
    """

    fits: tuple[Fit, ...]
    names: tuple[str, ...]
    cancelled: tuple[str, ...] = ()
    without_doubtful: Fit | None = None


def measure_best_laws(
    case: Case, split: Split, starts: Starts, report: Progress
) -> Measured | None:
    """Return the fit with measured laws from the best start; None where no law helps for sure.

    Whole windows decide which is the best; where they do not, the fewest laws do (`is_better`).
    Names that stay are asked whether the twin needs them beside the laws (`names_beside_laws`).

    Runs take long steps while laws are tried; the laws that are kept are fitted with the twin's
    own steps. A curve over time whose formula is lost there goes: it would be played in the next
    recording.
    """
    tried = replace(case, step_s=decisions.SEARCH_STEP_S)
    last = begin_without_laws(tried, split, starts.fits[-1])
    best = measure_from_starts(tried, split, starts, last, report)
    if best is None:
        return None
    if not best.is_at_noise:
        best = add_small_laws(best, report)
    coarse = best.law_fit
    fine = fit_laws(case, split, coarse.fit, coarse.curves, coarse.priors, coarse.inflation)
    measured = Measured(case, split, replace(fine, lead=coarse.lead), is_complete=True)
    lost = [k for k in list_over_time(measured) if measured.named[1][k].shape is None]
    kept = leave_curves_out(measured, lost) if lost else measured
    return kept if kept.law_fit.curves else None


def measure_from_starts(
    case: Case, split: Split, starts: Starts, last: LawFit, report: Progress
) -> Measured | None:
    """Return the best fit with measured laws of all starts; None where no law helps.

    Where no start gets ahead of the last start's effects, laws begin again from a start that was
    given up, and without the effects that may be there.

    last: the last of the starts; the others are fitted over its horizon.
    """
    best: Measured | None = None
    by_effects = {start.effects: start for start in starts.fits}
    behind = []
    for start in by_effects.values():
        measured = _measure_from(case, split, start, last, report, last.fit.choose)
        if measured is None:
            continue
        if not _is_ahead(measured, last):
            behind.append(start)
            continue
        if best is None or not is_better(best, measured, starts.names, starts.cancelled):
            best = measured
        if best.is_at_noise and len(best.kinds) == 1:
            return best
    if best is not None:
        return best
    again = [start for start in behind if start.effects != last.fit.effects]
    simple = starts.without_doubtful
    if simple is not None and simple.effects not in by_effects:
        again.append(simple)
    for start in again:
        measured = _measure_from(case, split, start, last, report)
        if measured is None or not _is_ahead(measured, last):
            continue
        if best is None or not is_better(best, measured, starts.names, starts.cancelled):
            best = measured
    return best


def _measure_from(
    case: Case,
    split: Split,
    start: Fit,
    last: LawFit,
    report: Progress,
    most: float = np.inf,
) -> Measured | None:
    """Return the fit with measured laws from a start; None where no law helps.

    most: misfit, in units of noise, that the first law may leave for a second law to be measured.
    """
    effects, best = start.effects, last.fit
    alike = effects == best.effects
    begun = last if alike else fit_without_laws(case, split, start, best.pieces)
    stood_for = {BY_NAME[name].law_kind for name in {*best.effects}.difference(effects)}
    return measure_laws(case, split, begun, report, most, frozenset(stood_for))


def _is_ahead(measured: Measured, last: LawFit) -> bool:
    """Return whether laws bring the twin further than the effects of the last start did."""
    return compute_lead(measured.named[0], last.fit).is_real


def is_better(
    simple: Measured, rich: Measured, names: Collection[str], cancelled: Collection[str] = ()
) -> bool:
    """Return whether the fit with fewer effects is the better of two with laws.

    A fit at the noise is better than a fit above the noise. Otherwise whole windows decide: over
    the short windows that laws are fitted to as a rule, an error that adds up counts little (a
    law in place of dry friction creeps from rest). Where neither fit is really ahead, the fit with
    fewer laws stays at the noise. Above the noise names stay, and other effects go.

    names: effects that are names; those that the simple fit lacks count.
    cancelled: effects that take each other back; each counts as a law.
    """
    if simple.is_at_noise != rich.is_at_noise:
        return simple.is_at_noise
    fewer, more = simple.over_whole_windows, rich.over_whole_windows
    spent, more_spent = (
        len(measured.kinds) + len({*measured.effects}.intersection(cancelled))
        for measured in (simple, rich)
    )
    lost = {*rich.effects}.difference(simple.effects).intersection(names)
    stays = spent <= more_spent if simple.is_at_noise else not lost
    return not compute_lead(more, fewer).is_real if stays else compute_lead(fewer, more).is_real
