"""The command is clipped below the limit that is known."""

from pendulum_twin.effects.effect import Effect, Form, Parameter, Place, Scale


def law(u, memory, h, t, limit):
    """Return u clipped to +-limit."""
    return min(max(u, -limit), limit)


def inverse(u, t, limit):
    """Return u clipped to +-limit: no command gives more."""
    return min(max(u, -limit), limit)


EFFECT = Effect(
    name="input_saturation",
    place=Place.COMMAND,
    form=Form.FILTER,
    law=law,
    inverse=inverse,
    memory=lambda h: 0,
    parameters=(
        Parameter(
            "limit",
            "1",
            1e6,
            0.0,
            1e6,
            (0.15, 0.3, 0.7, 0.9, 0.5),  # logs of unclipped commands reach far beyond a limit
            Scale.COMMAND,
            shape=True,
            idle_beyond=Scale.COMMAND,
        ),
    ),
    sentence="The command is clipped at +-{limit}.",
    source="Tao and Kokotovic, Adaptive Control of Systems with Actuator and Sensor "
    "Nonlinearities (1996), chapter 2",
    law_kind="command_curve",
)
