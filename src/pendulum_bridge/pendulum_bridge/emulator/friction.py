"""The cart's dry friction as a law of speed, place and direction; the engine gets it each step."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

Effects = Mapping[str, Mapping[str, float]]
# A law of t (s), x (m), th (rad), v (m/s), w (rad/s).
Law = Callable[[float, float, float, float, float], float]
# The same with the way (+1 or -1) before them; gives N.
Level = Callable[[float, float, float, float, float, float], float]


def make_constant_level(level_n: float) -> Law:
    """Return a law with the same level everywhere."""
    return lambda t, x, th, v, w: level_n


def make_stribeck_level(level_n: float, static_n: float, velocity_m_s: float) -> Law:
    """Return a law that adds static_n at rest, fading over the Stribeck velocity."""
    return lambda t, x, th, v, w: level_n + static_n * math.exp(-((v / velocity_m_s) ** 2))


def make_saturating_level(viscous_n_s_m: float, level_n: float, limit_n: float) -> Law:
    """Return a law that grows with speed from the level up to the limit."""

    def law(t: float, x: float, th: float, v: float, w: float) -> float:
        return min(level_n + viscous_n_s_m * abs(v), limit_n)

    return law


def make_patch_level(level_n: float, centre_m: float, width_m: float) -> Law:
    """Return a law with a bell along the rail."""
    return lambda t, x, th, v, w: level_n * math.exp(-(((x - centre_m) / width_m) ** 2))


LEVELS: dict[str, Callable[..., Law]] = {
    "cart_coulomb_friction": make_constant_level,
    "cart_stribeck_friction": make_stribeck_level,
    "cart_saturating_friction": make_saturating_level,
    "rail_friction_patch": make_patch_level,
}
STATE_DEPENDENT = {
    "cart_stribeck_friction",
    "cart_saturating_friction",
    "rail_friction_patch",
    "cart_friction_asymmetry",
}


def make_dry_level(effects: Effects, more: Sequence[Law] = ()) -> Level | None:
    """Return the cart's dry friction (N) as a law of way and state; None when it is constant.

    The engine has constant friction itself. The way (+1 or -1) is that of the motion, at rest
    that of the push.
    effects: the concealed effects of the catalogue.
    more: laws of levels (N) that the catalogue does not hold.
    """
    if not more and not STATE_DEPENDENT & effects.keys():
        return None
    laws = [make(**effects[name]) for name, make in LEVELS.items() if name in effects] + list(more)
    ratio = effects.get("cart_friction_asymmetry", {}).get("ratio", 0.0)

    def level(way: float, t: float, x: float, th: float, v: float, w: float) -> float:
        return (1.0 + ratio * way) * sum(law(t, x, th, v, w) for law in laws)

    return level
