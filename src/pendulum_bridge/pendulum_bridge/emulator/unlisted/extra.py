"""The laws that one piece of unlisted physics adds to the emulated rig."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from pendulum_bridge.emulator.friction import Law

# From the command and t, x, th, v, w to the command that acts.
Gain = Callable[[float, float, float, float, float, float], float]
# From t, x, th to position and angle as the sensors see them.
Shown = Callable[[float, float, float], tuple[float, float]]
# From the time by the stamps to true seconds a stamped second.
Pace = Callable[[float], float]


@dataclass(frozen=True)
class Extra:
    """Hold the laws that one piece of physics adds; None for a law that it leaves alone.

    All are laws of the true t (s), x (m), th (rad, 0 upright), v (m/s), w (rad/s).
    gain: command that acts, PWM fraction.
    push: force on the cart along the rail, N.
    twist: torque on the pole, N m.
    level: the cart's dry friction, N.
    shown: position (m) and angle (rad) that the sensors see.
    pace: true seconds a stamped second.
    """

    gain: Gain | None = None
    push: Law | None = None
    twist: Law | None = None
    level: Law | None = None
    shown: Shown | None = None
    pace: Pace | None = None
