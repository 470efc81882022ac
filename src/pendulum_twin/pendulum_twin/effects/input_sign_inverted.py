"""A positive command drives the cart the negative way."""

from pendulum_twin.effects.effect import Effect, Form, Place


def law(u, memory, h, t, on):
    """Return -u when on is 1."""
    return u * (1.0 - 2.0 * on)


def inverse(u, t, on):
    """Return -u when on is 1."""
    return u * (1.0 - 2.0 * on)


EFFECT = Effect(
    name="input_sign_inverted",
    place=Place.COMMAND,
    form=Form.FILTER,
    law=law,
    inverse=inverse,
    memory=lambda h: 0,
    sentence="A positive command drives the cart the negative way.",
    source="a matter of wiring; sign convention of the thesis, section 5.2",
)
