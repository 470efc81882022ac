"""A turn of the pole is not counted as a turn: the encoder has other counts than believed."""

from pendulum_twin.effects.effect import Effect, Form, Parameter, Place


def law(x, v, th, w, t, ratio):
    """Return the measured state; upright, where the angle is zero, stays zero."""
    return x, v, (1.0 + ratio) * th, (1.0 + ratio) * w


def inverse(x, v, th, w, t, ratio):
    """Return the true state."""
    return x, v, th / (1.0 + ratio), w / (1.0 + ratio)


EFFECT = Effect(
    name="angle_scale",
    place=Place.SENSOR,
    form=Form.MEASURE,
    law=law,
    inverse=inverse,
    parameters=(Parameter("ratio", "1", 0.0, -0.9, 9.0, (0.01,)),),
    sentence="The measured angle is too large by {ratio} of itself.",
    of_joint="pole",
    source="scale factor error of an encoder; counts a turn differ from those in the conversion",
    winds=True,
    read_off=True,
)
