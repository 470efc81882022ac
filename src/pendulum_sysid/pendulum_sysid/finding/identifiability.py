"""What a recording cannot tell apart, from the sensitivities of a finished fit."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from types import MappingProxyType

from pendulum_sysid import decisions
from pendulum_sysid.finding.exchange import Question, tied
from pendulum_sysid.finding.hypotheses import list_possible_effects
from pendulum_sysid.finding.separation import (
    Tie,
    compute_naming_threshold,
    list_doubles,
    pick_deciding_windows,
)
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.parameters import list_free_parameters
from pendulum_sysid.records import Fit, Split
from pendulum_twin.effects import BY_NAME
from pendulum_twin.effects.effect import Form

NO_RIVALS: Mapping[str, Collection[str]] = MappingProxyType({})


def find_ties(
    case: Case, split: Split, fit: Fit, also: Mapping[str, Collection[str]] = NO_RIVALS
) -> tuple[Tie, ...]:
    """Return what the windows that a diagnosis decides on cannot part from the effects that a fit holds beyond the twin's.

    Every effect is taken out in turn; the rest of the catalogue, one by one, may take its place in
    any size together with the rig's constants and the other effects' parameters. An effect that
    contains the one asked about is no rival of it.
    also: effect -> effects that scores could not part from it; they count as tied as long as a
    diagnosis could not be sure.
    """
    found = []
    for name in [
        one
        for one in fit.effects
        if one not in case.twin.effects and BY_NAME[one].form is not Form.REPORT
    ]:
        found += [
            Tie(name, e.name, 0.0, fit.theta, by_no_motion=True)
            for e in list_doubles(BY_NAME[name])
        ]
        by_score = also.get(name, ())
        sure = compute_naming_threshold(
            int(
                sum(fit.counts.sum(axis=0))
                * (len(split.train) + len(split.choose))
                / len(split.choose)
            )
        )
        near = tied(
            make_question(case, split, fit, name),
            list_possible_effects(case.twin.rig),
            sure if by_score else decisions.APART_STANDARD_ERRORS,
            by_score,
        )
        found += [
            one
            for one in near
            if one.distance < decisions.APART_STANDARD_ERRORS or one.rival in by_score
        ]
    return tuple(found)


def make_question(case: Case, split: Split, fit: Fit, name: str) -> Question:
    """Return the question about an effect of a fit, on the windows that a diagnosis decides on."""
    held = tuple(one for one in fit.effects if one != name)
    windows, weight = pick_deciding_windows(case.state, split, fit.parts)
    free = list_free_parameters(case.twin, held, case.scales)
    return Question(
        case.problem(windows),
        fit.power / weight,
        fit.theta,
        BY_NAME[name],
        held,
        free,
        case.scales,
    )
