"""The angle is read some time after the position: the sensors do not share one instant.

Runs along a recording show the delay as it is (`late_angle`). A live twin, a controller and
training have one state: they show the angle that the pole's rate tells, off by half of the pole's
acceleration times the square of the delay, 0.3 mrad at 2.4 ms and 100 rad/s^2.
"""

from pendulum_twin.effects.effect import HALF_STEP_S, Effect, Form, Parameter, Place

LONGEST_S = 0.1


def law(delay_s):
    """Return how much later than the position the angle is read, s."""
    return delay_s


EFFECT = Effect(
    name="angle_delay",
    place=Place.SENSOR,
    form=Form.LATE,
    law=law,
    parameters=(Parameter("delay_s", "s", 0.0, 0.0, LONGEST_S, (0.005, 0.02), least=HALF_STEP_S),),
    sentence="The angle is reported {delay_s} later than the position.",
    source="pure transport delay of one sensor; Ljung, System Identification (1999), section 4.2",
    needs_both_joints=True,
)
