"""The disc of the pole's encoder is off its axis: the angle runs ahead and behind once a turn.

An error that is the same at all angles is not part of the effect: `angle_offset` holds it.
"""

from pendulum_twin.effects.effect import Effect, Form, Parameter, Place
from pendulum_twin.elementary import sin_cos_of_array

LARGEST_RAD = 0.4  # of either part: beyond 0.7 the reading would stand still somewhere in a turn
INVERSIONS = 5  # Newton steps: from 0.6 rad at most they leave 0.2, 0.03, 6e-4, 3e-7, 5e-14


def law(x, v, th, w, t, sine_rad, cosine_rad):
    """Return the measured state."""
    sine, cosine = sin_cos_of_array(th)
    shown = th + sine_rad * sine + cosine_rad * cosine
    return x, v, shown, w * (1.0 + sine_rad * cosine - cosine_rad * sine)


def inverse(x, v, th, w, t, sine_rad, cosine_rad):
    """Return the true state, whose angle is found by Newton's method."""
    true = th
    for _ in range(INVERSIONS):
        sine, cosine = sin_cos_of_array(true)
        ahead = true + sine_rad * sine + cosine_rad * cosine - th
        true = true - ahead / (1.0 + sine_rad * cosine - cosine_rad * sine)
    sine, cosine = sin_cos_of_array(true)
    return x, v, true, w / (1.0 + sine_rad * cosine - cosine_rad * sine)


EFFECT = Effect(
    name="eccentric_encoder",
    place=Place.SENSOR,
    form=Form.MEASURE,
    law=law,
    inverse=inverse,
    parameters=(
        Parameter("sine_rad", "rad", 0.0, -LARGEST_RAD, LARGEST_RAD, (0.05,)),
        Parameter("cosine_rad", "rad", 0.0, -LARGEST_RAD, LARGEST_RAD, (0.05, -0.05)),
    ),
    sentence="The encoder's disc is off its axis: the measured angle is the true one plus "
    "{sine_rad} times its sine and {cosine_rad} times its cosine.",
    of_joint="pole",
    source="geometry of a disc that is read at one place, to first order in its offset over its "
    "radius",
    law_kind="angle_error_over_turn",
    law_parts=("sine", "cosine"),
)
