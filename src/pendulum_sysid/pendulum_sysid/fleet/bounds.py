"""What a size can be: the range that a twin file may give it. Intervals of sizes end there."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from pendulum_sysid.fleet.pooling import Family, Pooled
from pendulum_sysid.fleet.rows import RIG
from pendulum_twin.effects import BY_NAME
from pendulum_twin.rig import RANGES

UNBOUNDED = (-float("inf"), float("inf"))


def get_bounds(owner: str, parameter: str) -> tuple[float, float]:
    """Return the lowest and the highest value that a size can have, in its unit.

    Unbounded where nothing says so: an effect of the user's own that is not loaded here.
    """
    if owner == RIG:
        return RANGES.get(parameter, UNBOUNDED)
    parameters = BY_NAME[owner].parameters if owner in BY_NAME else ()
    return next(((p.low, p.high) for p in parameters if p.name == parameter), UNBOUNDED)


def clip_to_bounds(value: float, bounds: tuple[float, float]) -> float:
    """Return the value that a size can have and that is nearest to `value`."""
    return min(max(value, bounds[0]), bounds[1])


def clip_pooled(pooled: Pooled, bounds: tuple[float, float]) -> Pooled:
    """Return a pooled size whose value and intervals are what the size can be."""
    names = ("value", "low", "high", "expected_low", "expected_high")
    ends: dict[str, Any] = {n: clip_to_bounds(getattr(pooled, n), bounds) for n in names}
    return replace(pooled, **ends)


def clip_family(family: Family, bounds: tuple[float, float]) -> Family:
    """Return a family whose mean, its interval and rigs are what the size can be."""
    ends: dict[str, Any] = {
        n: clip_to_bounds(getattr(family, n), bounds) for n in ("mean", "low", "high")
    }
    return replace(family, rigs=tuple(clip_pooled(r, bounds) for r in family.rigs), **ends)
