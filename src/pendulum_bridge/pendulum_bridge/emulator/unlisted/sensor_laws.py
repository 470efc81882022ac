"""Unlisted physics of sensors and clock: what is shown is not where the rig is, or when.

Sizes are for a rig of 0.7 kg, 6.4 N and a pole of 0.13 N m.
"""

from __future__ import annotations

import math

from pendulum_bridge.emulator.unlisted.extra import Extra
from pendulum_twin.rig import Rig


def make_kinked_tape(rig: Rig, per_m: float, from_m: float) -> Extra:
    """Show a position whose scale is another on one part of the rail: a tape with a joint."""
    return Extra(shown=lambda t, x, th: (x + per_m * max(x - from_m, 0.0), th))


def make_clock_wander(rig: Rig, ratio: float, period_s: float, phase_rad: float) -> Extra:
    """Let the time between samples go slowly up and down while the stamps say that it does not."""
    return Extra(pace=lambda t: 1 + ratio * math.sin(math.tau * t / period_s + phase_rad))


def make_bent_rack(rig: Rig, per_m: float) -> Extra:
    """Show a position that is off by the square of the position."""
    return Extra(shown=lambda t, x, th: (x + per_m * x * abs(x), th))


def make_wobbling_disc(rig: Rig, amplitude_rad: float, phase_rad: float) -> Extra:
    """Show an angle that runs ahead and behind twice a turn."""
    return Extra(shown=lambda t, x, th: (x, th + amplitude_rad * math.sin(2 * th + phase_rad)))
