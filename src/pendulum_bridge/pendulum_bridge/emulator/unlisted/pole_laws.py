"""Unlisted physics of the pole: torques on its bearing, from springs to stirred air.

Sizes are for a rig of 0.7 kg, 6.4 N and a pole of 0.13 N m.
"""

from __future__ import annotations

import math

from pendulum_bridge.emulator.unlisted.extra import Extra
from pendulum_twin.rig import Rig


def make_bearing_notch(rig: Rig, torque_n_m: float, phase_rad: float) -> Extra:
    """Turn the pole towards three places of its bearing."""
    return Extra(twist=lambda t, x, th, v, w: torque_n_m * math.sin(3 * th + phase_rad))


def make_air_jet(rig: Rig, torque_n_m: float) -> Extra:
    """Turn the pole with a constant torque."""
    return Extra(twist=lambda t, x, th, v, w: torque_n_m)


def make_stirred_air(rig: Rig, n_s2: float) -> Extra:
    """Brake the pole in proportion to its rate and to the cart's speed."""
    return Extra(twist=lambda t, x, th, v, w: -n_s2 * abs(v) * w)


def make_bearing_hysteresis(rig: Rig, n_m_per_rad: float, width_rad: float) -> Extra:
    """Turn the pole back with a spring whose other end is dragged along width behind."""
    end: float | None = None

    def twist(t: float, x: float, th: float, v: float, w: float) -> float:
        nonlocal end
        end = th if end is None else min(max(end, th - width_rad), th + width_rad)
        return n_m_per_rad * (end - th)

    return Extra(twist=twist)


def make_pole_magnet(rig: Rig, torque_n_m: float, angle_rad: float) -> Extra:
    """Turn the pole towards one angle when it is near."""

    def twist(t: float, x: float, th: float, v: float, w: float) -> float:
        away = math.remainder(th - angle_rad, math.tau) / 0.5
        return -torque_n_m * away * math.exp(-away * away)

    return Extra(twist=twist)


def make_taut_cable(rig: Rig, n_m_per_m: float) -> Extra:
    """Turn the pole in proportion to the cart's way: a cable that the pole drags."""
    return Extra(twist=lambda t, x, th, v, w: -n_m_per_m * x)


def make_oily_bearing(rig: Rig, n_m_s: float) -> Extra:
    """Brake the pole in proportion to its rate, most above the cart and not at all below."""
    return Extra(twist=lambda t, x, th, v, w: -n_m_s * (1 + math.cos(th)) * w)
