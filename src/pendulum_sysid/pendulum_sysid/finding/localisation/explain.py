"""Which questions explain a missing force: chosen one after another by what they gain on samples held out."""

from __future__ import annotations

from itertools import combinations
from math import comb

from pendulum_sysid.finding.localisation.questions import Cost
from pendulum_sysid.finding.localisation.table import Table

LEAST_SHARE = 0.02  # of the missing power
CLEARLY = 0.05  # of the missing power, by which a dearer answer must be ahead of a cheaper one
SURE = 4.0  # standard errors over blocks: some sixty questions are asked, so three would be passed by chance
CERTAIN = 10.0  # the same, for gains that are small beside the noise: the filters themselves may make some of it
SMALL = 0.25  # of the noise's power
MOST = 4


def missing_power(table: Table, found: tuple[str, ...] = ()) -> float:
    """Return the power that is missing beyond the sensors' noise, whatever the twin's own words; at least what was found."""
    return max(table.loss(()) - table.balance.noise**2, table.loss(()) - table.loss(found), 0.0)


def explanation(table: Table) -> tuple[str, ...]:
    """Return the questions that explain a missing force, in the order in which they were found."""
    found: tuple[str, ...] = ()
    while len(found) < MOST:
        best = _next(table, found)
        if best is None:
            break
        found = (*found, best)
    return _pruned(table, found)


def _next(table: Table, found: tuple[str, ...]) -> str | None:
    """Return the question to add: of those that explain about as much, the cheapest."""
    losses = {key: table.loss((*found, key)) for key in table.asked if key not in found}
    if not losses:
        return None
    best = min(losses, key=lambda key: losses[key])
    missing = missing_power(table, (*found, best))
    for cost in (Cost.CURVE, Cost.NUMBER):
        cheaper = {key: loss for key, loss in losses.items() if table.asked[key].cost <= cost}
        if not cheaper or table.asked[best].cost <= cost:
            continue
        other = min(cheaper, key=lambda key: cheaper[key])
        ahead = losses[other] - losses[best]
        if ahead < CLEARLY * missing or table.lead((*found, best), (*found, other)) < SURE:
            best = other
    worth = table.gain(best, found) >= LEAST_SHARE * missing
    return best if worth and more_than_chance(table, best, found) else None


def more_than_chance(table: Table, key: str, beside: tuple[str, ...] = ()) -> bool:
    """Return whether what a question gains beside others is neither chance nor an imperfection of the method."""
    gain, small = table.gain(key, beside), SMALL * table.balance.noise**2
    return gain > 0 and table.lead((*beside, key), beside) >= (SURE if gain >= small else CERTAIN)


def _pruned(table: Table, found: tuple[str, ...]) -> tuple[str, ...]:
    """Return the questions without those that the later ones have made needless."""
    missing = missing_power(table, found)
    for key in found:
        less = tuple(one for one in found if one != key)
        if table.gain(key, less) < LEAST_SHARE * missing:
            return _pruned(table, less)
    return found


def gains(table: Table, found: tuple[str, ...]) -> dict[str, float]:
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
