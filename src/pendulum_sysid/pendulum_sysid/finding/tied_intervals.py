"""Intervals that hold whichever of tied effects is there.

Where an effect cannot be told from another effect, the recording fits as well with the other, and
with other constants of the rig. An interval that holds for the named effect alone says more than
the recording does.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

from pendulum_sysid.finding.intervals import widen_estimate
from pendulum_sysid.finding.journal import Search
from pendulum_sysid.finding.judge import is_outdone
from pendulum_sysid.finding.naming import Named
from pendulum_sysid.finding.separation import Tie
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.parameters import list_free_parameters
from pendulum_sysid.records import Fit
from pendulum_twin.arrays import Floats
from pendulum_twin.effects import BY_NAME
from pendulum_twin.parameter_vector import SLOTS, get_neutral_values


def fit_rivals(
    search: Search, best: Fit, named: Iterable[Named], ties: Iterable[Tie]
) -> tuple[Named, ...]:
    """Return the names with the fits of all effects that cannot be told from them.

    Naming has fitted some of them. The others are what sensitivities cannot part from a name, and
    what looks the same in every motion of a rig with other constants.

    ties: of the fit.
    """
    ties, rivalled = tuple(ties), []
    for effect in named:
        known = {name for fit in effect.rivals for name in fit.effects}
        tied = [tie for tie in ties if tie.effect == effect.effect]
        others = [
            _fit_in_place(search, best, effect.effect, rival, theta)
            for rival, theta in _list_starts(best, tied)
            if rival not in known
        ]
        as_good = [fit for fit in others if not is_outdone(fit, best)]
        rivalled.append(replace(effect, rivals=(*effect.rivals, *as_good)))
    return tuple(rivalled)


def hold_rivals(case: Case, best: Fit, named: Iterable[Named]) -> Fit:
    """Return a fit whose intervals hold those of the fits with rivals in the places of names."""
    rivals = [rival for effect in named for rival in effect.rivals]
    estimates = dict(best.estimates)
    for free in list_free_parameters(case.twin, best.effects, case.scales):
        own = estimates[free.name]
        every = [own, *(fit.estimates[free.name] for fit in rivals if free.name in fit.estimates)]
        below = max(own.value - estimate.low for estimate in every)
        above = max(estimate.high - own.value for estimate in every)
        estimates[free.name] = widen_estimate(own, free, below, above)
    return replace(best, estimates=estimates) if rivals else best


def _list_starts(best: Fit, ties: Iterable[Tie]) -> Iterator[tuple[str, Floats]]:
    """Yield the rivals of an effect, each with the parameter vector that its fit starts from.

    A double with the same constants of the rig needs no fit: it changes no interval.
    """
    for tie in ties:
        if tie.rival is None:
            continue
        own, rival = BY_NAME[tie.effect], BY_NAME[tie.rival]
        if not tie.by_no_motion:
            yield tie.rival, tie.theta
        elif own.shows_as_with or rival.shows_as_with:
            theta = best.theta.copy()
            theta[SLOTS[tie.effect]] = get_neutral_values(own)
            theta[SLOTS[tie.rival]] = [parameter.probes[0] for parameter in rival.parameters]
            yield tie.rival, theta


def _fit_in_place(search: Search, best: Fit, name: str, rival: str, theta: Floats) -> Fit:
    effects = tuple(rival if effect == name else effect for effect in best.effects)
    return search.fit_effects(effects, best, theta)
