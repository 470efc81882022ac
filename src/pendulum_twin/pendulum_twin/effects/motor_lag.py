"""The force follows the command as a first-order lag: the motor's electrical time constant, an amplifier's filter."""

import math

from pendulum_twin.effects.effect import HALF_STEP_S, Effect, Form, Parameter, Place


def law(u, memory, h, t, time_constant_s):
    """Return the mean over this substep of the lagged command (exact for a command held over the "
    "substep)."""
    if memory[0] == 0.0:
        memory[0] = 1.0
        memory[1] = u
    if time_constant_s < 1e-9:
        memory[1] = u
        return u
    gone = -math.expm1(-h / time_constant_s)
    off = memory[1] - u
    memory[1] = u + off * (1.0 - gone)
    return u + off * gone * time_constant_s / h


EFFECT = Effect(
    name="motor_lag",
    place=Place.DRIVE,
    form=Form.FILTER,
    law=law,
    memory=lambda h: 2,
    parameters=(
        Parameter(
            "time_constant_s", "s", 0.0, 0.0, 1.0, (0.02, 0.08), least=HALF_STEP_S, delays=True
        ),
    ),
    sentence="The force follows the command with a time constant of {time_constant_s}.",
    source="first-order hold-equivalent lag; Astrom and Wittenmark, Computer-Controlled Systems "
    "(1997), chapter 2",
    smooth=True,
)
