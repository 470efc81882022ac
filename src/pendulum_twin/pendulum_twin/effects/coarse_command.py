"""The drive knows few steps of the command: a converter or a timer with few bits."""

import math

from pendulum_twin.effects.effect import Effect, Form, Parameter, Place, Scale


def law(u, memory, h, t, step):
    """Return the multiple of the step that is nearest to u."""
    return step * math.floor(u / step + 0.5) if step > 0.0 else u


def inverse(u, t, step):
    """Return a command that gives the multiple of the step nearest to u."""
    return u


EFFECT = Effect(
    name="coarse_command",
    place=Place.COMMAND,
    form=Form.FILTER,
    law=law,
    inverse=inverse,
    memory=lambda h: 0,
    parameters=(
        # a smaller change of the step rounds so few commands to another side that no fit tells
        Parameter(
            "step", "1", 0.0, 0.0, 1e3, (0.2, 0.1), Scale.COMMAND, shape=True, most=1.0, jumps=5e-4
        ),
    ),
    sentence="The drive knows only multiples of {step} of the command, and takes the nearest.",
    source="uniform mid-tread quantiser; B. Widrow and I. Kollar, Quantization Noise (2008), "
    "chapter 1",
    law_kind="command_curve",
)
