"""Curves by their values at knots: places of the knots, and weights of interpolation between."""

from __future__ import annotations

import numpy as np

from pendulum_sysid import decisions
from pendulum_twin.arrays import Floats


def make_hats(values: Floats, knots: Floats) -> Floats:
    """Return the weights of linear interpolation between rising knots, (n, knots)."""
    weights = np.zeros((len(values), len(knots)))
    if len(knots) == 1:
        weights[:, 0] = 1.0
        return weights
    inside = np.clip(values, knots[0], knots[-1])
    left = np.clip(np.searchsorted(knots, inside, side="right") - 1, 0, len(knots) - 2)
    part = (inside - knots[left]) / (knots[left + 1] - knots[left])
    rows = np.arange(len(values))
    weights[rows, left] = 1.0 - part
    weights[rows, left + 1] = part
    return weights


def spread_knots(values: Floats, count: int) -> Floats:
    """Return rising knots over the values' range, between evenly spread and evenly filled."""
    even, filled = (
        np.linspace(values.min(), values.max(), count),
        np.quantile(values, np.linspace(0, 1, count)),
    )
    return np.unique(0.5 * (even + filled))


def make_sided_knots(values: Floats) -> tuple[Floats, Floats]:
    """Return knots (k,) and hats (n, k) of a variable, at whose zero a force may jump."""
    knots, sides = [], []
    for sign in (-1.0, 1.0):
        side = np.maximum(sign * values, 0.0)
        reached = side[side > 0]
        if len(reached) < 2 * decisions.SIDE_KNOTS:
            continue
        at = spread_knots(np.append(reached, 0.0), decisions.SIDE_KNOTS)
        part = make_hats(side, at) * (side > 0)[:, None]
        knots.append(at if sign > 0 else -at[::-1])
        sides.append(part if sign > 0 else part[:, ::-1])
    if not sides:
        return np.zeros(1), np.ones((len(values), 1))
    return np.concatenate(knots), np.concatenate(sides, axis=1)
