"""Find what a twin lacks: signs first, then a set of effects that is grown, pruned and named.

The set grows by one effect at a time with joint refits (`growth`), and effects that the others
have made needless leave it (`pruning`), each step judged on windows that are left out (`judge`).
A short horizon comes first: errors stay where they arise. A long horizon follows, over which small
errors add up until they show.

Runs take long steps while sets are tried; what the search ends at is fitted with the twin's own.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from pendulum_sysid import decisions
from pendulum_sysid.finding.growth import find_steps, grow_set
from pendulum_sysid.finding.identifiability import find_ties
from pendulum_sysid.finding.journal import Journal, Progress, Search, report_nothing
from pendulum_sysid.finding.judge import (
    compute_distance,
    compute_lead,
    judge_over_whole_windows,
)
from pendulum_sysid.finding.naming import (
    Named,
    add_readings,
    add_replications,
    add_ties,
    doubt_intervals,
    name_effects,
)
from pendulum_sysid.finding.pole_alone import PoleAnswer, add_pole_effects, search_pole_alone
from pendulum_sysid.finding.propose import list_replaced, put_effect
from pendulum_sysid.finding.pruning import prune_set
from pendulum_sysid.finding.rounding import doubt_rounding
from pendulum_sysid.finding.separation import Tie
from pendulum_sysid.finding.signs import fit_parameters_alone
from pendulum_sysid.finding.spoiled_windows import find_spoiled, leave_windows_out, pick_windows
from pendulum_sysid.finding.stages import Stage
from pendulum_sysid.finding.subsets import find_subsets
from pendulum_sysid.finding.tied_intervals import fit_rivals, hold_rivals
from pendulum_sysid.finding.unnamed import widen_sizes
from pendulum_sysid.finding.weights import WeighedSet, weigh_sets
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.fit import fit_over_horizon
from pendulum_sysid.records import Fit, Split
from pendulum_twin.arrays import Floats
from pendulum_twin.effects import BY_NAME
from pendulum_twin.parameter_vector import SLOTS, get_neutral_values


@dataclass(frozen=True)
class Answer:
    """Hold what a search ends at.

    base: the fit of parameters alone, over the horizon of the best fit.
    best: the fit with all effects that are needed.
    named: these effects, and what could stand in their places.
    perhaps: effects of the best fit that are not sure enough to be named.
    ties: what the recording cannot part from them, by sensitivities.
    sets: the sets of effects that were tried, and how much each is believed.
    pole: what the pole shows by itself, which backs some of the effects; None where the pole was
        not asked or did not help.
    journal: every fit that was tried, in order.
    """

    base: Fit
    best: Fit
    named: tuple[Named, ...]
    perhaps: tuple[Named, ...]
    ties: tuple[Tie, ...]
    sets: tuple[WeighedSet, ...]
    pole: PoleAnswer | None
    journal: Journal


@dataclass(frozen=True)
class Explanation:
    """Hold a fit that explains the errors of the base.

    fit: with all effects that are needed.
    pole: as of `Answer`.
    """

    fit: Fit
    pole: PoleAnswer | None

    @property
    def expected(self) -> tuple[str, ...]:
        """Return the effects that the pole names."""
        return self.pole.effects if self.pole is not None else ()


def search_effects(case: Case, split: Split, report: Progress = report_nothing) -> Answer:
    """Return what the case's twin lacks: fitted, named, and with what it cannot be told from.

    report: takes a line of progress for a person.
    """
    search = Search(replace(case, step_s=decisions.SEARCH_STEP_S), split, Journal(report))
    report(Stage.CONSTANTS)
    base = fit_parameters_alone(search)
    return conclude_search(case, search, base, explain_misfit(search, base))


def search_in_place(
    case: Case, split: Split, answer: Answer, wider: Mapping[str, Floats]
) -> Answer:
    """Return the answer with effects in the place of those of its best fit that they contain.

    wider: effect -> its parameters, to start from; measured laws have refuted what it contains.
    """
    effects, theta = answer.best.effects, answer.best.theta.copy()
    refuted: tuple[str, ...] = ()
    for name, values in wider.items():
        replaced = list_replaced(BY_NAME[name], effects)
        for effect in replaced:
            theta[SLOTS[effect]] = get_neutral_values(BY_NAME[effect])
        theta[SLOTS[name]] = values
        effects, refuted = put_effect(BY_NAME[name], effects), (*refuted, *replaced)
    quick = replace(case, step_s=decisions.SEARCH_STEP_S)
    search = Search(quick, split, answer.journal, refuted=refuted)
    fit = search.fit_effects(effects, answer.best, theta)
    search.journal.note(fit, "measured laws ask for it")
    return conclude_search(case, search, answer.base, Explanation(fit, answer.pole))


def conclude_search(case: Case, search: Search, base: Fit, explanation: Explanation) -> Answer:
    """Return what there is to say of the fit that a search ends at.

    case: with the twin's own steps.
    base: the fit of parameters alone.
    """
    split, report = search.split, search.journal.report
    report(Stage.NAMING)
    named = name_effects(search, base, explanation.fit, explanation.pole)
    report(Stage.TIES)
    rivals = {effect.effect: effect.inseparable_from for effect in named}
    ties = find_ties(case, split, explanation.fit, rivals)
    ties = tuple(tie for tie in ties if tie.rival not in search.refuted)
    possible = (f for f in search.journal.fits if not set(f.effects).intersection(search.refuted))
    sets = weigh_sets(possible, explanation.fit)
    report(Stage.REPLICATING)
    named = add_replications(search, explanation.fit, add_ties(named, ties), sets)
    alike = {rival for effect in named for rival in effect.inseparable_from}
    pieces = explanation.fit.pieces  # with the twin's own steps from here on
    best = fit_over_horizon(case, split, explanation.fit, pieces)
    base = fit_over_horizon(case, split, base, pieces)
    widened = widen_sizes(case, split, best, alike)
    named = doubt_intervals(best, widened, named, case.scales)
    best, named = add_readings(case, widened, named)
    named = doubt_rounding(case, best, named)
    lasting = tuple(effect for effect in named if effect.is_lasting)
    perhaps = tuple(effect for effect in named if not effect.is_lasting)
    lasting = fit_rivals(search, explanation.fit, lasting, ties)
    best = hold_rivals(case, best, lasting)
    pole, journal = explanation.pole, search.journal
    return Answer(base, best, lasting, perhaps, ties, sets, pole, journal)


def explain_misfit(search: Search, base: Fit) -> Explanation:
    """Return the base with what is missing: over a short horizon first, then over a long one."""
    pole = search_pole_alone(search, base)
    search.journal.report(Stage.GROWING)
    start = add_pole_effects(search, base, pole.best, pole.effects) if pole else base
    steps = find_steps(search, start)
    grown = grow_set(search, steps[0]) if steps else start
    expected = pole.effects if pole is not None else ()
    short = Explanation(prune_set(search, base.effects, grown, expected), pole)
    return extend_horizon(search, base, begin_with_subsets(search, base, short))


def begin_with_subsets(search: Search, base: Fit, explanation: Explanation) -> Explanation:
    """Return what a search finds that begins with several effects at once, if that is better.

    What the pole steadily shows by itself is part of every set.

    explanation: what the search so far found; returned where no other search is better, and where
        it ends at the noise.
    """
    if explanation.fit.choose <= decisions.MISFIT_AT_NOISE or not decisions.BEGIN_WITH_SUBSETS:
        return explanation
    search.journal.report(Stage.SUBSETS)
    pole = explanation.pole if explanation.pole and explanation.pole.steady else None
    shown = pole.steady if pole else ()
    start = add_pole_effects(search, base, pole.best, shown) if pole else base
    best = explanation.fit
    for subset in find_subsets(search, start, decisions.SUBSET_EFFECTS - len(shown)):
        fit = search.fit_effects(subset.effects, start, subset.theta)
        search.journal.note(fit, "begun with several effects at once")
        if compute_lead(fit, best).is_real:
            best = fit
    if best is explanation.fit:
        return explanation
    grown = grow_set(search, best)
    return Explanation(prune_set(search, base.effects, grown, shown), pole)


def extend_horizon(search: Search, base: Fit, explanation: Explanation) -> Explanation:
    """Return the explanation continued over the long horizon, where its fit is better.

    Over a long horizon the errors of missing effects add up, too. What it adds must show over the
    short horizon (`is_shown_near`). Windows that a few instants have spoiled are not asked, if the
    others are at the noise then: they would bend the fit (`spoiled_windows`).
    """
    search.journal.report(Stage.LONG)
    short = explanation.fit
    begun = search.fit_over_horizon(short, 1)
    spoiled = find_spoiled(begun)
    if spoiled.any():
        rest, near = leave_windows_out(search, spoiled), pick_windows(short, ~spoiled)
        calm = rest.fit_over_horizon(near, 1)
        if calm.choose <= decisions.MISFIT_AT_NOISE:
            far = add_over_horizon(rest, base, near, calm, explanation.expected)
            if far is near:
                return explanation
            known = replace(short, effects=far.effects, theta=far.theta)
            return replace(explanation, fit=search.fit_over_horizon(known, far.pieces))
    return replace(
        explanation, fit=add_over_horizon(search, base, short, begun, explanation.expected)
    )


def add_over_horizon(
    search: Search, base: Fit, short: Fit, begun: Fit, expected: tuple[str, ...]
) -> Fit:
    """Return the short fit, or the better fit that a search over the long horizon ends at.

    Where the long horizon ends above the noise it takes no effect away.

    begun: the effects of the short fit, fitted over the long horizon.
    expected: effects that the pole names.
    """
    grown = grow_set(search, begun)
    if grown.choose <= decisions.MISFIT_AT_NOISE:
        long = prune_set(search, base.effects, grown, expected)
        near = fit_near(search, short, long)
        return long if is_shown_near(near, short) else short
    long = prune_set(search, short.effects, grown, expected)
    near = fit_near(search, short, long)
    if not is_shown_near(near, short):
        long, near = begun, short
    elif near is not short:
        near = prune_set(search, base.effects, near, expected)
    better = compute_lead(long, judge_over_whole_windows(search.case, search.split, near)).is_real
    return long if better else near


def fit_near(search: Search, short: Fit, long: Fit) -> Fit:
    """Return the effects of a long fit fitted over the short horizon.

    short, long: the fits that the searches over either horizon ended at.
    """
    same = long.effects == short.effects
    return short if same else search.fit_over_horizon(long, short.pieces)


def is_shown_near(near: Fit, short: Fit) -> bool:
    """Return whether the effects that the long horizon added show over the short horizon.

    near: of `fit_near`.

    Near upright an error of the start state grows over a second until any effect that bends the
    motion seems to help.
    """
    added = [name for name in near.effects if name not in short.effects]
    if not added or not decisions.CONFIRM_LONG_HORIZON:
        return True
    shows = all(compute_distance(near, name, short.effects) > 1.0 for name in added)
    return shows and compute_lead(near, short).ratio > 1.0
