"""The cart's position is read off a pulley that is off its axis: ahead and behind once a turn.

A scale that is wrong everywhere is not part of the effect: `position_scale` holds it.
"""

from pendulum_twin.effects.cogging import PERIODS, PHASES
from pendulum_twin.effects.effect import Effect, Form, Parameter, Place, Scale
from pendulum_twin.elementary import sin_cos_of_array

LARGEST = 0.4  # beyond 1 the reading would go backwards somewhere
INVERSIONS = 8  # Newton steps: each doubles the digits, and the first error is 0.4 rad at most


def law(x, v, th, w, t, ratio, period_m, phase_rad):
    """Return the measured state; the reading goes (1 + ratio cos) times as fast as the cart."""
    turn = 6.283185307179586 / period_m
    sine, cosine = sin_cos_of_array(turn * x + phase_rad)
    return x + ratio / turn * sine, v * (1.0 + ratio * cosine), th, w


def inverse(x, v, th, w, t, ratio, period_m, phase_rad):
    """Return the true state, whose position is found by Newton's method."""
    turn = 6.283185307179586 / period_m
    true = x
    for _ in range(INVERSIONS):
        sine, cosine = sin_cos_of_array(turn * true + phase_rad)
        true = true - (true + ratio / turn * sine - x) / (1.0 + ratio * cosine)
    cosine = sin_cos_of_array(turn * true + phase_rad)[1]
    return true, v / (1.0 + ratio * cosine), th, w


EFFECT = Effect(
    name="eccentric_pulley",
    place=Place.SENSOR,
    form=Form.MEASURE,
    law=law,
    inverse=inverse,
    parameters=(
        Parameter("ratio", "1", 0.0, 0.0, LARGEST, (0.1,)),
        Parameter(
            "period_m",
            "m",
            1.0,
            1e-2,
            100.0,
            PERIODS,
            Scale.CART_TRAVEL,
            shape=True,
            most=1.0,
            fewest=0.03,
        ),
        Parameter("phase_rad", "rad", 0.0, -10.0, 10.0, PHASES, shape=True, phase=True),
    ),
    sentence="The pulley that measures the cart's position is off its axis: the reading goes "
    "faster and slower than the cart by {ratio} of its speed, every {period_m} (phase "
    "{phase_rad}).",
    of_joint="cart",
    source="geometry of a pulley that a belt turns, to first order in its offset over its radius",
    law_kind="position_error_along_rail",
)
