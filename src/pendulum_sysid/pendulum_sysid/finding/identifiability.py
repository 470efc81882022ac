"""What a recording cannot tell apart, from the sensitivities of a finished fit."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from types import MappingProxyType

from pendulum_sysid import decisions
from pendulum_sysid.finding.exchange import ExchangeQuestion, find_near_effects
from pendulum_sysid.finding.hypotheses import list_possible_effects
from pendulum_sysid.finding.separation import (
    Tie,
    compute_naming_threshold,
    list_doubles,
    pose_on_deciding_windows,
)
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.parameters import list_free_parameters, list_rig_parameters
from pendulum_sysid.records import Fit, Split
from pendulum_twin.effects import BY_NAME
from pendulum_twin.effects.effect import Form

NO_RIVALS: Mapping[str, Collection[str]] = MappingProxyType({})


def find_ties(
    case: Case, split: Split, fit: Fit, also: Mapping[str, Collection[str]] = NO_RIVALS
) -> tuple[Tie, ...]:
    """Return what the deciding windows cannot part from the effects that a fit has found.

    Every effect is taken out in turn; the rest of the catalogue, one by one, may take its place in
    any size together with the rig's constants and the other effects' parameters. An effect that
    contains the effect in question is no rival of it.

    also: effect -> effects that, fitted in its place, predict left-out windows as well
        (`naming.name_effects`); they count as tied as long as a diagnosis could not be sure.
    """
    apart, ties = decisions.APART_STANDARD_ERRORS, []
    sure = compute_naming_threshold(int(sum(fit.counts.sum(axis=0))))
    new = [name for name in fit.effects if name not in case.twin.effects]
    for name in [n for n in new if BY_NAME[n].form is not Form.REPORT]:
        doubles = list_doubles(BY_NAME[name], list_rig_parameters(case.twin))
        ties += [Tie(name, e.name, 0.0, fit.theta, by_no_motion=True) for e in doubles]
        as_good = also.get(name, ())
        near = find_near_effects(
            make_question(case, split, fit, name),
            list_possible_effects(case.twin.rig),
            sure if as_good else apart,
            as_good,
        )
        ties += [tie for tie in near if tie.distance < apart or tie.rival in as_good]
    return tuple(ties)


def make_question(case: Case, split: Split, fit: Fit, name: str) -> ExchangeQuestion:
    """Return the question about an effect of a fit, on the windows that a diagnosis decides on."""
    others = tuple(effect for effect in fit.effects if effect != name)
    problem, power = pose_on_deciding_windows(case, split, fit)
    return ExchangeQuestion(
        problem=problem,
        power=power,
        theta=fit.theta,
        effect=BY_NAME[name],
        others=others,
        free=list_free_parameters(case.twin, others, case.scales),
        scales=case.scales,
    )
