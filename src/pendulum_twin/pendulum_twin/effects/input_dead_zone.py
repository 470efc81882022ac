"""Small commands do nothing; larger ones lose the width of the zone."""

import math

from pendulum_twin.effects.effect import Effect, Form, Parameter, Place, Scale


def law(u, memory, h, t, width):
    """Return u moved towards 0 by width, 0 inside +-width."""
    return max(u - width, 0.0) + min(u + width, 0.0)


def inverse(u, t, width):
    """Return u moved away from 0 by width; 0 for 0."""
    return u + math.copysign(width, u) if u != 0.0 else 0.0


EFFECT = Effect(
    name="input_dead_zone",
    place=Place.COMMAND,
    form=Form.FILTER,
    law=law,
    inverse=inverse,
    memory=lambda h: 0,
    parameters=(Parameter("width", "1", 0.0, 0.0, 1e6, (0.05, 0.2), Scale.COMMAND),),
    sentence="Commands within +-{width} do nothing.",
    source="Tao and Kokotovic, Adaptive Control of Systems with Actuator and Sensor "
    "Nonlinearities (1996), chapter 2",
    law_kind="command_curve",
)
