"""The belt between motor and cart stretches: the cart swings against the motor's own mass.

The motor pulls one end of a spring with a damper, the cart hangs at the other end. What the belt
passes on of the motor's force is a second-order resonance; forces that act on the cart itself are
taken for forces on all that moves, which they are far below the resonance.
"""

import math

from pendulum_twin.effects.effect import HALF_STEP_S, Effect, Form, Parameter, Place

SHORTEST_S = 1e-9


def law(u, memory, h, t, period_s, damping):
    """Return the mean over this substep of what the belt passes on; u is held over the substep.

    memory: whether the law has been called, the belt's pull without its damper, its slope, 1/s.

    z'' + 2 d r z' + r^2 z = r^2 u with r = 2 pi / period, and the pull is z + 2 d z' / r, which is
    u - z'' / r^2: its mean follows from z' at both ends of the substep.
    """
    if memory[0] == 0.0:
        memory[0] = 1.0
        memory[1] = u
    if period_s < SHORTEST_S:
        memory[1], memory[2] = u, 0.0
        return u
    r = 2.0 * math.pi / period_s
    way, slope = memory[1] - u, memory[2]
    turning = r * math.sqrt(1.0 - damping * damping)
    fades, cosine = math.exp(-damping * r * h), math.cos(turning * h)
    sine = math.sin(turning * h) / turning
    memory[1] = u + fades * (way * (cosine + damping * r * sine) + slope * sine)
    memory[2] = fades * (slope * (cosine - damping * r * sine) - way * r * r * sine)
    return u - (memory[2] - slope) / (h * r * r)


EFFECT = Effect(
    name="stretching_belt",
    place=Place.DRIVE,
    form=Form.FILTER,
    law=law,
    memory=lambda h: 3,
    parameters=(
        Parameter("period_s", "s", 0.0, 0.0, 2.0, (0.06, 0.12, 0.25), least=HALF_STEP_S),
        Parameter("damping", "1", 0.1, 0.0, 0.95, (0.1,), shape=True),
    ),
    sentence="The belt between motor and cart stretches: the cart swings against the motor with a "
    "period of {period_s} and {damping} of the critical damping.",
    source="two masses with a spring and a damper between them; K. Ogata, System Dynamics (2004), "
    "section 7.4",
    smooth=True,
)
