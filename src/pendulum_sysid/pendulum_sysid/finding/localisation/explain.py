"""Choose the questions that explain a missing force, by what they gain on held-out samples."""

from __future__ import annotations

from itertools import combinations
from math import comb

from pendulum_sysid import decisions
from pendulum_sysid.finding.localisation.questions import Cost
from pendulum_sysid.finding.localisation.table import Table


def compute_missing_power(table: Table, keys: tuple[str, ...] = ()) -> float:
    """Return the power that is missing beyond the sensors' noise, the twin's constants refitted.

    keys: questions that explain some of it; at least what they take away is missing.
    """
    return max(
        table.compute_loss(()) - table.balance.noise**2,
        table.compute_loss(()) - table.compute_loss(keys),
        0.0,
    )


def explain(table: Table) -> tuple[str, ...]:
    """Return the questions that explain a missing force, in the order in which they were found."""
    keys: tuple[str, ...] = ()
    while len(keys) < decisions.EVIDENCE_MOST:
        best = _choose_next(table, keys)
        if best is None:
            break
        keys = (*keys, best)
    return _prune(table, keys)


def _choose_next(table: Table, keys: tuple[str, ...]) -> str | None:
    """Return the question to add: of those that explain about as much, the cheapest."""
    losses = {key: table.compute_loss((*keys, key)) for key in table.questions if key not in keys}
    if not losses:
        return None
    best = min(losses, key=lambda key: losses[key])
    missing = compute_missing_power(table, (*keys, best))
    for cost in (Cost.CURVE, Cost.NUMBER):
        cheaper = {key: loss for key, loss in losses.items() if table.questions[key].cost <= cost}
        if not cheaper or table.questions[best].cost <= cost:
            continue
        other = min(cheaper, key=lambda key: cheaper[key])
        ahead = losses[other] - losses[best]
        if (
            ahead < decisions.DEARER_SHARE * missing
            or table.compute_lead((*keys, best), (*keys, other))
            < decisions.EVIDENCE_STANDARD_ERRORS
        ):
            best = other
    worth = table.compute_gain(best, keys) >= decisions.EVIDENCE_LEAST_SHARE * missing
    return best if worth and is_more_than_chance(table, best, keys) else None


def is_more_than_chance(table: Table, key: str, beside: tuple[str, ...] = ()) -> bool:
    """Return whether a question's gain beside others is neither chance nor made by the method."""
    gain, small = table.compute_gain(key, beside), decisions.SMALL_GAIN * table.balance.noise**2
    return gain > 0 and table.compute_lead((*beside, key), beside) >= (
        decisions.EVIDENCE_STANDARD_ERRORS
        if gain >= small
        else decisions.SMALL_GAIN_STANDARD_ERRORS
    )


def _prune(table: Table, keys: tuple[str, ...]) -> tuple[str, ...]:
    """Return the questions without those that the later ones have made needless."""
    missing = compute_missing_power(table, keys)
    for key in keys:
        less = tuple(other for other in keys if other != key)
        if table.compute_gain(key, less) < decisions.EVIDENCE_LEAST_SHARE * missing:
            return _prune(table, less)
    return keys


def share_gains(table: Table, keys: tuple[str, ...]) -> dict[str, float]:
    """Return how much power each question explains, shared fairly (Shapley's division)."""
    shared = {}
    for key in keys:
        others = [n for n in keys if n != key]
        share = 0.0
        for size in range(len(others) + 1):
            for some in combinations(others, size):
                share += (table.compute_gain(key, some)) / (len(keys) * comb(len(others), size))
        shared[key] = max(share, 0.0)
    return shared
