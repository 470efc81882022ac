"""Which questions explain a missing force: chosen one after another by what they gain on samples held out."""

from __future__ import annotations

from itertools import combinations
from math import comb

from pendulum_sysid import decisions
from pendulum_sysid.finding.localisation.questions import Cost
from pendulum_sysid.finding.localisation.table import Table


def compute_missing_power(table: Table, found: tuple[str, ...] = ()) -> float:
    """Return the power that is missing beyond the sensors' noise, whatever the twin's own words; at least what was found."""
    return max(table.loss(()) - table.balance.noise**2, table.loss(()) - table.loss(found), 0.0)


def explain(table: Table) -> tuple[str, ...]:
    """Return the questions that explain a missing force, in the order in which they were found."""
    found: tuple[str, ...] = ()
    while len(found) < decisions.EVIDENCE_MOST:
        best = _choose_next(table, found)
        if best is None:
            break
        found = (*found, best)
    return _prune(table, found)


def _choose_next(table: Table, found: tuple[str, ...]) -> str | None:
    """Return the question to add: of those that explain about as much, the cheapest."""
    losses = {key: table.loss((*found, key)) for key in table.asked if key not in found}
    if not losses:
        return None
    best = min(losses, key=lambda key: losses[key])
    missing = compute_missing_power(table, (*found, best))
    for cost in (Cost.CURVE, Cost.NUMBER):
        cheaper = {key: loss for key, loss in losses.items() if table.asked[key].cost <= cost}
        if not cheaper or table.asked[best].cost <= cost:
            continue
        other = min(cheaper, key=lambda key: cheaper[key])
        ahead = losses[other] - losses[best]
        if (
            ahead < decisions.DEARER_SHARE * missing
            or table.lead((*found, best), (*found, other)) < decisions.EVIDENCE_STANDARD_ERRORS
        ):
            best = other
    worth = table.gain(best, found) >= decisions.EVIDENCE_LEAST_SHARE * missing
    return best if worth and is_more_than_chance(table, best, found) else None


def is_more_than_chance(table: Table, key: str, beside: tuple[str, ...] = ()) -> bool:
    """Return whether what a question gains beside others is neither chance nor an imperfection of the method."""
    gain, small = table.gain(key, beside), decisions.SMALL_GAIN * table.balance.noise**2
    return gain > 0 and table.lead((*beside, key), beside) >= (
        decisions.EVIDENCE_STANDARD_ERRORS
        if gain >= small
        else decisions.SMALL_GAIN_STANDARD_ERRORS
    )


def _prune(table: Table, found: tuple[str, ...]) -> tuple[str, ...]:
    """Return the questions without those that the later ones have made needless."""
    missing = compute_missing_power(table, found)
    for key in found:
        less = tuple(one for one in found if one != key)
        if table.gain(key, less) < decisions.EVIDENCE_LEAST_SHARE * missing:
            return _prune(table, less)
    return found


def share_gains(table: Table, found: tuple[str, ...]) -> dict[str, float]:
    """Return how much power each question explains; together they explain what all explain (Shapley's division)."""
    shared = {}
    for key in found:
        others = [n for n in found if n != key]
        share = 0.0
        for size in range(len(others) + 1):
            for some in combinations(others, size):
                share += (table.gain(key, some)) / (len(found) * comb(len(others), size))
        shared[key] = max(share, 0.0)
    return shared
