"""The range of motion that a recording visited: beyond, no twin was compared with the rig."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from pendulum_sysid.fitting.case import Case
from pendulum_sysid.telling.display import render_number
from pendulum_twin.arrays import Floats, Mask

NEARLY_UP = 0.95 * math.pi  # rad from hanging: from there on all angles were visited

Range = tuple[float, float]


def measure_visited(case: Case) -> dict[str, Range]:
    """Return the lowest and the highest value of each variable, by its name in the verdict.

    Of the cart its position (m) and velocity (m/s), of the pole its angle from hanging (rad, up to
    half a turn to either side) and its rate (rad/s), smoothed, where samples are valid; of the
    commands all. Joints that the recording lacks are left out.
    """
    signals, states = case.signals, case.state.states
    angles = np.remainder(states[:, 1], 2.0 * math.pi) - math.pi
    columns = {
        "cart_position": (states[:, 0], signals.cart_valid, signals.cart is not None),
        "cart_velocity": (states[:, 2], signals.cart_valid, signals.cart is not None),
        "pole_angle": (angles, signals.pole_valid, signals.pole is not None),
        "pole_rate": (states[:, 3], signals.pole_valid, signals.pole is not None),
        "command": (signals.command, np.ones(len(signals), dtype=bool), signals.cart is not None),
    }
    return {
        name: _measure_range(values, valid)
        for name, (values, valid, recorded) in columns.items()
        if recorded and np.any(valid)
    }


def _measure_range(values: Floats, valid: Mask) -> Range:
    return float(np.min(values[valid])), float(np.max(values[valid]))


def describe_visited(visited: Mapping[str, Range]) -> str:
    """Return a sentence on the range of motion; empty for a verdict that does not hold it."""
    parts = []
    if "cart_position" in visited:
        low, high = (render_number(end) for end in visited["cart_position"])
        fastest = _describe_fastest(visited, "cart_velocity")
        parts.append(f"the cart goes from {low} to {high} m{fastest}")
    if "pole_angle" in visited:
        farthest = max(abs(end) for end in visited["pole_angle"])
        angles = f"up to {render_number(farthest)} rad from hanging"
        if farthest >= NEARLY_UP:
            angles = "through all angles"
        parts.append(f"the pole goes {angles}{_describe_fastest(visited, 'pole_rate')}")
    if not parts:
        return ""
    motion = ", and ".join(parts)
    return f"In this recording {motion}. Beyond, no twin was compared with the rig."


def _describe_fastest(visited: Mapping[str, Range], name: str) -> str:
    fastest = max(abs(end) for end in visited[name])
    return f", at up to {render_number(fastest)} {'m/s' if name == 'cart_velocity' else 'rad/s'}"
