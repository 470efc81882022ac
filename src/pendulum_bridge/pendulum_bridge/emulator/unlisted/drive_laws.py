"""Unlisted physics of command and drive: a gain that is not the same everywhere or always.

Sizes are for a rig of 0.7 kg, 6.4 N and a pole of 0.13 N m.
"""

from __future__ import annotations

import math

from pendulum_bridge.emulator.unlisted.extra import Extra
from pendulum_twin.rig import Rig


def make_gain_along_rail(rig: Rig, per_m: float) -> Extra:
    """Change the gain along the rail: a belt that is tighter at one end."""
    return Extra(gain=lambda u, t, x, th, v, w: u * (1 + per_m * x))


def make_gain_falling_with_speed(rig: Rig, s_per_m: float) -> Extra:
    """Take force away in proportion to command and speed: a weak supply."""
    return Extra(gain=lambda u, t, x, th, v, w: u * max(1 - s_per_m * abs(v), 0.0))


def make_supply_ripple(rig: Rig, ratio: float, frequency_hz: float, phase_rad: float) -> Extra:
    """Let the gain go slowly up and down in time."""
    return Extra(
        gain=lambda u, t, x, th, v, w: (
            u * (1 + ratio * math.sin(math.tau * frequency_hz * t + phase_rad))
        )
    )


def make_crossover_amplifier(rig: Rig, share: float, width: float) -> Extra:
    """Take a share of small commands away: the halves of an output stage that barely meet."""
    return Extra(gain=lambda u, t, x, th, v, w: u * (1 - share * math.exp(-((u / width) ** 2))))


def make_recovering_battery(rig: Rig, share: float, time_s: float) -> Extra:
    """Let the gain begin too small by a share, and recover."""
    return Extra(gain=lambda u, t, x, th, v, w: u * (1 - share * math.exp(-t / time_s)))
