"""The cart's position is counted the wrong way round."""

from pendulum_twin.effects.effect import Effect, Form, Place


def law(x, v, th, w, t, on):
    """Return the measured state; the law is its own inverse."""
    sign = 1.0 - 2.0 * on
    return sign * x, sign * v, th, w


EFFECT = Effect(
    name="cart_sign_inverted",
    place=Place.SENSOR,
    form=Form.MEASURE,
    law=law,
    inverse=law,
    sentence="The cart's position is counted the wrong way round.",
    of_joint="cart",
    source="a matter of wiring; sign convention of the thesis, section 5.2",
    needs_both_joints=True,
)
