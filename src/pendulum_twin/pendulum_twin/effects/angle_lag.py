"""The angle's sensor follows the angle with a first-order lag: a filter of resistor and capacitor.

Runs along a recording show the lag as it is (`lagging_angle`). A live twin, a controller and
training have one state: they show the angle that the pole's rate tells, off by the pole's
acceleration times the square of the time constant, 10 mrad at 10 ms and 100 rad/s^2.
"""

from pendulum_twin.effects.effect import HALF_STEP_S, Effect, Form, Parameter, Place

LONGEST_S = 0.1


def law(time_constant_s):
    """Return the time constant with which the measured angle follows the angle, s."""
    return time_constant_s


EFFECT = Effect(
    name="angle_lag",
    place=Place.SENSOR,
    form=Form.LAGGING,
    law=law,
    parameters=(
        Parameter("time_constant_s", "s", 0.0, 0.0, LONGEST_S, (0.005, 0.02), least=HALF_STEP_S),
    ),
    sentence="The measured angle follows the angle with a time constant of {time_constant_s}.",
    source="first-order lag of a sensor; K. Ogata, System Dynamics (2004), section 8.2",
    needs_both_joints=True,
)
