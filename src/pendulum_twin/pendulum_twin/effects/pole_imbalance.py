"""The centre of mass lies beside the line from axis to tip along which the angle is read."""

from pendulum_twin.effects.effect import Effect, Form, Parameter, Place


def law(x, v, th, w, t, angle_rad):
    """Return the measured state: the line's angle; the true one is that of the centre of mass."""
    return x, v, th - angle_rad, w


def inverse(x, v, th, w, t, angle_rad):
    """Return the true state, whose angle is that of the centre of mass."""
    return x, v, th + angle_rad, w


EFFECT = Effect(
    name="pole_imbalance",
    place=Place.POLE,
    form=Form.MEASURE,
    law=law,
    inverse=inverse,
    parameters=(Parameter("angle_rad", "rad", 0.0, -3.2, 3.2, (0.02,)),),
    sentence="The centre of mass lies {angle_rad} ahead of the pole's line.",
    of_joint="pole",
    source="weight of a rigid body about an axis, its first moment turned by a constant angle",
    shows_as="angle_offset",
    separated_by="a plumb line beside the pole at rest would: an encoder that is off leaves the "
    "pole itself plumb",
    law_kind="pole_torque_by_angle",
)
