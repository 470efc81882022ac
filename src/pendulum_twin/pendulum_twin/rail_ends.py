"""Stop the cart of a live twin at the ends of its rail, as the rig's buffers do.

The kernel that fits and simulates has no ends: a recording ends before the rail does. A live twin
needs them, for its user may drive the cart anywhere.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from pendulum_twin.arrays import Floats
from pendulum_twin.parameter_vector import COUPLING, INERTIA
from pendulum_twin.rig import Rig


@dataclass(frozen=True)
class Impact:
    """Hold what an end of the rail has done to the cart.

    end_m: m; the end, with its sign along the rail.
    speed_m_s: m/s; speed of the cart against the end, at least 0.
    """

    end_m: float
    speed_m_s: float


def find_end_m(rig: Rig) -> float:
    """Return the distance of the rail's ends from its middle, m; infinite when there are none."""
    return rig.rail_half_length_m or math.inf if rig.has_cart else math.inf


def stop_cart(true: Floats, theta: Floats, end_m: float) -> Impact | None:
    """Set a cart that has passed an end back to the end, at rest; return the impact, or None.

    true: (4,) true x (m), th (rad), v (m/s), w (rad/s); changed in place.
    theta: (SIZE,) the twin's parameters.
    end_m: m, distance of the ends from the middle.

    The end takes the cart's whole momentum (no rebound) and gives the pole none: the momentum
    Jp w - S cos(th) v, which belongs to the angle, stays. The contact is resolved once a step, so
    that position and velocity are exact after each step, and the instant of the impact is known to
    a step.
    """
    x, th, v, w = true
    if abs(x) <= end_m:
        return None
    end = math.copysign(end_m, x)
    speed = max(v * math.copysign(1.0, x), 0.0)
    true[0] = end
    if speed > 0.0:
        true[2] = 0.0
        true[3] = w - theta[COUPLING] * math.cos(th) * v / theta[INERTIA]
    return Impact(end, speed)
