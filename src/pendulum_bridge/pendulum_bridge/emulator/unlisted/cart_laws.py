"""Unlisted physics of the cart: forces and dry friction along the rail and in time.

Sizes are for a rig of 0.7 kg, 6.4 N and a pole of 0.13 N m.
"""

from __future__ import annotations

import math

import numpy as np

from pendulum_bridge.emulator.unlisted.extra import Extra
from pendulum_twin.rig import Rig


def make_warming_friction(rig: Rig, n_per_s: float) -> Extra:
    """Let the cart's dry friction grow with time from nothing."""
    return Extra(level=lambda t, x, th, v, w: n_per_s * t)


def make_half_rail_friction(rig: Rig, level_n: float, from_m: float) -> Extra:
    """Add dry friction on one part of the rail only, with a sharp edge."""
    return Extra(level=lambda t, x, th, v, w: level_n if x > from_m else 0.0)


def make_fanned_cart(rig: Rig, n_s2_per_m: float) -> Extra:
    """Brake the cart in proportion to its speed and to the pole's rate: by air that it stirs."""
    return Extra(push=lambda t, x, th, v, w: -n_s2_per_m * abs(w) * v)


def make_drag_chain(rig: Rig, n_per_m3: float) -> Extra:
    """Pull the cart back with the cube of its distance from the middle."""
    return Extra(push=lambda t, x, th, v, w: -n_per_m3 * x**3)


def make_hanging_cable(rig: Rig, n_s_per_m2: float) -> Extra:
    """Brake the cart in proportion to speed and position, so drive it on the other side."""
    return Extra(push=lambda t, x, th, v, w: -n_s_per_m2 * x * v)


def make_outward_brake(rig: Rig, n_s_per_m: float) -> Extra:
    """Brake the cart in proportion to its speed while it goes away from the middle."""
    return Extra(push=lambda t, x, th, v, w: -n_s_per_m * v if x * v > 0.0 else 0.0)


def make_dragged_cable(rig: Rig, n_per_m: float, width_m: float) -> Extra:
    """Pull the cart back with a spring whose other end is dragged along width behind."""
    end: float | None = None

    def push(t: float, x: float, th: float, v: float, w: float) -> float:
        nonlocal end
        end = x if end is None else min(max(end, x - width_m), x + width_m)
        return n_per_m * (end - x)

    return Extra(push=push)


def make_leaning_guide(rig: Rig, level_n: float) -> Extra:
    """Add dry friction of the cart that is largest while the pole is level."""
    return Extra(level=lambda t, x, th, v, w: level_n * math.sin(th) ** 2)


def make_draught(rig: Rig, force_n: float, phase_rad: float) -> Extra:
    """Push the cart at random: a wind of many slow waves that never repeats."""
    random = random_waves(phase_rad)
    return Extra(
        push=lambda t, x, th, v, w: (
            force_n * sum(math.sin(math.tau * hertz * t + phase) for hertz, phase in random)
        )
    )


def random_waves(seed: float) -> list[tuple[float, float]]:
    """Return frequencies, Hz, and phases, rad, of 12 waves that a number stands for."""
    numbers = np.random.default_rng(int(1e6 * (seed + 10.0)))
    return [
        (float(hertz), float(phase))
        for hertz, phase in zip(
            numbers.uniform(0.1, 2.0, 12), numbers.uniform(0.0, math.tau, 12), strict=True
        )
    ]
