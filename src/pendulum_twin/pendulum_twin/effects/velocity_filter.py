"""The reported velocities follow the true ones as a first-order lag: a filter against the noise of differences."""

import math

from pendulum_twin.effects.effect import Effect, Form, Parameter, Place


def law(v, before, period_s, time_constant_s):
    """Return the reported velocity, from the true one and the one reported a sample before."""
    return before + (v - before) * (1.0 - math.exp(-period_s / max(time_constant_s, 1e-9)))


EFFECT = Effect(
    name="velocity_filter",
    place=Place.SENSOR,
    form=Form.REPORT,
    law=law,
    parameters=(Parameter("time_constant_s", "s", 0.0, 0.0, 1.0, (0.02, 0.08)),),
    sentence="The reported velocities lag behind with a time constant of {time_constant_s}.",
    source="first-order low-pass; Astrom and Wittenmark, Computer-Controlled Systems (1997), "
    "chapter 2",
)
