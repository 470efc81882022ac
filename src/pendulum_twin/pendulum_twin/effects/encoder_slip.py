"""The pole's encoder slips on its shaft: from some time on the angle is off."""

from pendulum_twin.effects.effect import Effect, Form, Parameter, Place, Scale


def law(x, v, th, w, t, angle_rad, time_s):
    """Return the measured state."""
    return x, v, th + angle_rad * (t >= time_s), w


def inverse(x, v, th, w, t, angle_rad, time_s):
    """Return the true state."""
    return x, v, th - angle_rad * (t >= time_s), w


EFFECT = Effect(
    name="encoder_slip",
    place=Place.SENSOR,
    form=Form.MEASURE,
    law=law,
    inverse=inverse,
    parameters=(
        Parameter("angle_rad", "rad", 0.0, -6.4, 6.4, (0.02,)),
        Parameter("time_s", "s", 0.0, 0.0, 1e6, (0.5,), Scale.SECONDS, shape=True, located=True),
    ),
    sentence="From {time_s} on the measured angle is off by {angle_rad}.",
    of_joint="pole",
    source="additive abrupt fault; Basseville and Nikiforov, Detection of Abrupt Changes (1993), "
    "section 7.2",
    of_recording=True,
    timed=True,
)
