"""The belt between motor and cart stretches: the cart swings against the motor's own mass.

The motor pulls one end of a spring with a damper, the cart hangs at the other end. What the belt
passes on of the motor's force is a second-order resonance. Other forces on the cart reach the
motor's mass through the same resonance: the cart answers them with the motor's mass beside its own
only where they change slowly.
"""

import math

from pendulum_twin.effects.effect import HALF_STEP_S, Effect, Form, Parameter, Place, Reaction
from pendulum_twin.elementary import exp, sin_cos

SHORTEST_S = 1e-9


def swing(way, slope, r, damping, fades, cosine, sine):
    """Return way and slope, 1/s, of a free oscillator after a substep.

    fades, cosine, sine: of the substep; the sine over the damped circular frequency, s.
    """
    return (
        fades * (way * (cosine + damping * r * sine) + slope * sine),
        fades * (slope * (cosine - damping * r * sine) - way * r * r * sine),
    )


def law(u, memory, h, t, period_s, damping, motor_share):
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
    way, memory[2] = swing(way, slope, r, damping, fades, cosine, sine)
    memory[1] = u + way
    return u - (memory[2] - slope) / (h * r * r)


def compute_share(period_s, damping, motor_share):
    """Return the motor's share of the moved mass; behind a stiff belt the motor is cart."""
    return motor_share if period_s >= SHORTEST_S else 0.0


def react(push, lag, slope, h, period_s, damping, motor_share):
    """Return lag, slope and pull after a substep; push, N, is held over it and the next.

    The stretch s of the belt obeys m (1 - k) (s'' + 2 d r s' + r^2 s) = (1 - k) / k drive - push,
    with k the motor's share of the mass m. The push's part of it is -lag / (m (1 - k) r^2), and
    the law of the lag is that of z above.
    """
    r = 2.0 * math.pi / max(period_s, SHORTEST_S)
    turning = r * math.sqrt(1.0 - damping * damping)
    fades = exp(-damping * r * h)
    sine, cosine = sin_cos(turning * h)
    sine /= turning
    way, slope = swing(lag - push, slope, r, damping, fades, cosine, sine)
    after = swing(way, slope, r, damping, fades, cosine, sine)[1]
    return push + way, slope, push - (after - slope) / (h * r * r)


EFFECT = Effect(
    name="stretching_belt",
    place=Place.DRIVE,
    form=Form.FILTER,
    law=law,
    reaction=Reaction(compute_share, react),
    memory=lambda h: 3,
    parameters=(
        Parameter(
            "period_s", "s", 0.0, 0.0, 2.0, (0.06, 0.12, 0.25), least=HALF_STEP_S, resonant=True
        ),
        Parameter("damping", "1", 0.1, 0.0, 0.95, (0.1,), shape=True),
        Parameter("motor_share", "1", 0.1, 0.0, 0.8, (0.1,), shape=True, optional=True),
    ),
    sentence="The belt between motor and cart stretches: the cart swings against the motor, "
    "{motor_share} of all that moves, with a period of {period_s} and {damping} of the critical "
    "damping.",
    source="two masses with a spring and a damper between them; K. Ogata, System Dynamics (2004), "
    "section 7.4",
    smooth=True,
)
