"""The pole's angle is counted the wrong way round."""

import math

from pendulum_twin.effects.effect import Effect, Form, Place


def law(x, v, th, w, t, on):
    """Return the measured state, mirrored at hanging (pi stays pi); the law is its own inverse."""
    sign = 1.0 - 2.0 * on
    return x, v, sign * th + 2.0 * math.pi * on, sign * w


EFFECT = Effect(
    name="angle_sign_inverted",
    place=Place.SENSOR,
    form=Form.MEASURE,
    law=law,
    inverse=law,
    sentence="The pole's angle is counted the wrong way round.",
    of_joint="pole",
    source="a matter of wiring; sign convention of the thesis, section 5.2",
    needs_both_joints=True,
)
