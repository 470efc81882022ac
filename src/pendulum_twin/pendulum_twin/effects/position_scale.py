"""The position is counted too long or too short: another pulley radius than believed."""

from pendulum_twin.effects.effect import Effect, Form, Parameter, Place


def law(x, v, th, w, t, ratio):
    """Return the measured state."""
    return (1.0 + ratio) * x, (1.0 + ratio) * v, th, w


def inverse(x, v, th, w, t, ratio):
    """Return the true state."""
    return x / (1.0 + ratio), v / (1.0 + ratio), th, w


EFFECT = Effect(
    name="position_scale",
    place=Place.SENSOR,
    form=Form.MEASURE,
    law=law,
    inverse=inverse,
    parameters=(Parameter("ratio", "1", 0.0, -0.9, 9.0, (0.02,)),),
    sentence="The measured position is too large by {ratio} of itself.",
    of_joint="cart",
    source="scale factor error of an encoder on a belt; the pole's weight is what shows it, for g "
    "is known",
    needs_both_joints=True,
    law_kind="position_error_along_rail",
    law_parts=("slope",),
)
