"""The drive bends instead of clipping: the larger the command, the less of it is added."""

import math

from pendulum_twin.effects.effect import Effect, Form, Parameter, Place, Scale

NEUTRAL = 1e6
NEARLY = 1.0 - 1e-12  # of the limit: what no command gives is not asked for


def law(u, memory, h, t, limit):
    """Return limit tanh(u / limit)."""
    return limit * math.tanh(u / limit) if limit < NEUTRAL else u


def inverse(u, t, limit):
    """Return the command that gives u, or comes nearest to it."""
    return limit * math.atanh(min(max(u / limit, -NEARLY), NEARLY)) if limit < NEUTRAL else u


EFFECT = Effect(
    name="soft_saturation",
    place=Place.COMMAND,
    form=Form.FILTER,
    law=law,
    inverse=inverse,
    memory=lambda h: 0,
    parameters=(
        Parameter(
            "limit",
            "1",
            NEUTRAL,
            1e-6,
            NEUTRAL,
            (1.5, 1.0, 0.7),
            Scale.COMMAND,
            shape=True,
            most=4.0,
        ),
    ),
    sentence="The command bends towards +-{limit}: the drive's force grows less and less with it.",
    source="the hyperbolic tangent as the usual smooth saturation",
    law_kind="command_curve",
)
