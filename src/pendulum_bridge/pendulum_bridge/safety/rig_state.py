"""What the rig shows at one moment, as the safety decisions need it."""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass

ABSURD = 1e9  # m, rad, m/s or rad/s: no rig gets there, and the square of a much larger one is no float any more


@dataclass(frozen=True)
class RigState:
    """Hold one sample.

    cart_m: 0 in the middle of the rail. pole_rad: 0 upright, counterclockwise positive, pi
    hanging, not wrapped.
    cart_m_s, pole_rad_s: their velocities.
    """

    cart_m: float
    pole_rad: float
    cart_m_s: float
    pole_rad_s: float

    @property
    def finite(self) -> bool:
        """Return whether all of it are numbers that can be used: no NaN, no infinity, nothing beyond ABSURD."""
        return all(abs(value) < ABSURD for value in astuple(self))

    @property
    def from_hanging_rad(self) -> float:
        """Return how far the pole is from hanging, -pi to pi, whatever whole turns it has made."""
        return math.remainder(self.pole_rad - math.pi, 2 * math.pi)
