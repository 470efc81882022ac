"""The state of the rig at a sampling time, as the safety decisions need it."""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass

# m, rad, m/s or rad/s: beyond any rig, and the square of a much larger number is no float
ABSURD = 1e9


@dataclass(frozen=True)
class RigState:
    """Hold a sample.

    cart_m: m; 0 in the middle of the rail.
    pole_rad: rad; 0 upright, counterclockwise positive, pi hanging, not wrapped.
    cart_m_s: m/s.
    pole_rad_s: rad/s.
    """

    cart_m: float
    pole_rad: float
    cart_m_s: float
    pole_rad_s: float

    @property
    def finite(self) -> bool:
        """Whether every value is usable: no NaN, no infinity, nothing beyond ABSURD."""
        return all(abs(value) < ABSURD for value in astuple(self))

    @property
    def from_hanging_rad(self) -> float:
        """The angle from hanging, rad, -pi to pi, without whole turns."""
        return math.remainder(self.pole_rad - math.pi, 2 * math.pi)
