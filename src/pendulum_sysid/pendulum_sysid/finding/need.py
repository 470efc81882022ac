"""Decide whether a set of effects needs one of them: by how far it leads, or by its steadiness."""

from __future__ import annotations

from pendulum_sysid import decisions
from pendulum_sysid.finding.environments import measure_steadiness
from pendulum_sysid.finding.journal import Search
from pendulum_sysid.finding.judge import compute_distance, compute_lead, is_needed
from pendulum_sysid.records import Fit


def needs_effect(
    search: Search, rich: Fit, simple: Fit, effect: str, expected: bool = False
) -> bool:
    """Return whether a rich fit needs the effect that the simple fit lacks.

    Where much has no name, a sure lead may be small beside what is left, and any effect that
    follows what is left leads a little. In the search of the pole by itself a true cause has the
    same size in every environment (`Steadiness`). On the whole rig the effects that stand in for
    an uneven drive have the same size everywhere, too, so that steadiness tells nothing there.

    expected: other evidence names the effect; the rich fit need only be ahead.
    """
    if is_needed(rich, simple, effect, expected):
        return True
    sure = compute_lead(rich, simple).is_sure
    away = compute_distance(rich, effect, simple.effects) > 1.0
    if not (search.is_pole_alone and decisions.ACCEPT_STEADY and sure and away):
        return False
    steadiness = measure_steadiness(search.case, search.split, rich).get(effect)
    return steadiness is not None and steadiness.is_steady
