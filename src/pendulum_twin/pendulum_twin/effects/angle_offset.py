"""The encoder's zero is off: the measured angle is the true one plus a constant."""

from pendulum_twin.effects.effect import Effect, Form, Parameter, Place


def law(x, v, th, w, t, angle_rad):
    """Return the measured state."""
    return x, v, th + angle_rad, w


def inverse(x, v, th, w, t, angle_rad):
    """Return the true state."""
    return x, v, th - angle_rad, w


EFFECT = Effect(
    name="angle_offset",
    place=Place.SENSOR,
    form=Form.MEASURE,
    law=law,
    inverse=inverse,
    parameters=(Parameter("angle_rad", "rad", 0.0, -3.2, 3.2, (0.02,)),),
    sentence="The measured angle is the true one plus {angle_rad}.",
    of_joint="pole",
    source="bias of an incremental encoder whose zero was set by hand",
    law_kind="angle_error_over_turn",
    law_parts=("mean",),
    set_at_start=True,
)
