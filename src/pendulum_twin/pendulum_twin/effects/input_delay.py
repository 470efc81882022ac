"""The command takes effect some time after it was sent."""

import math

from pendulum_twin.effects.effect import HALF_STEP_S, Effect, Form, Parameter, Place

LONGEST_S = 0.3


def law(u, memory, h, t, delay_s):
    """Return the mean over this substep of the command delay_s ago; memory is a ring of past "
    "commands."""
    size = len(memory) - 1
    if memory[0] == 0.0:
        memory[0] = 1.0
        memory[1:] = u
    now = int(memory[0]) - 1
    memory[1 + now] = u
    memory[0] = (now + 1) % size + 1.0
    whole = int(delay_s / h)
    part = delay_s / h - whole
    return (1.0 - part) * memory[1 + (now - whole) % size] + part * memory[
        1 + (now - whole - 1) % size
    ]


def memory(h):
    """Return the ring's size: the longest delay, the two substeps between which it falls, and "
    "the position."""
    return math.ceil(LONGEST_S / h) + 3


EFFECT = Effect(
    name="input_delay",
    place=Place.COMMAND,
    form=Form.FILTER,
    law=law,
    memory=memory,
    parameters=(
        Parameter(
            "delay_s", "s", 0.0, 0.0, LONGEST_S, (0.01, 0.04), least=HALF_STEP_S, delays=True
        ),
    ),
    sentence="The command takes effect {delay_s} late.",
    source="pure transport delay; Ljung, System Identification (1999), section 4.2",
    smooth=True,
)
