"""The amplifier limits the motor's current: the force is limited, and less so against the motion.

A voltage drives a current against the motor's counter voltage, which grows with the speed. Below
the limit the counter voltage is viscous friction. At the limit the force no longer depends on it.
"""

from pendulum_twin.effects.effect import Effect, Form, Parameter, Place, Scale


def law(force, v, force_per_pwm_n, limit, counter_n_s_m):
    """Return the drive's force, N, and what is added to the cart's viscous friction, N s/m.

    Below the limit both stay. At the limit the counter voltage's part of the friction is gone.
    """
    current = force - counter_n_s_m * v
    most = limit * force_per_pwm_n
    if current > most:
        return most, -counter_n_s_m
    if current < -most:
        return -most, -counter_n_s_m
    return force, 0.0


EFFECT = Effect(
    name="motor_current_limit",
    place=Place.DRIVE,
    form=Form.DRIVE,
    law=law,
    constants=("force_per_pwm_n",),
    parameters=(
        Parameter(
            "limit",
            "1",
            1e6,
            0.0,
            1e6,
            (0.3, 0.7),
            Scale.COMMAND,
            shape=True,
            idle_beyond=Scale.COMMAND,
        ),
        Parameter(
            "counter_n_s_m",
            "N s/m",
            0.0,
            0.0,
            1e6,
            (0.3,),
            Scale.FORCE,
            Scale.CART_SPEED,
            1,
            shape=True,
        ),
    ),
    sentence="The motor's current is limited as by a command of {limit}, with {counter_n_s_m} of "
    "the cart's viscous friction from the motor's counter voltage.",
    source="permanent-magnet motor behind an amplifier with a current limit; K. Ogata, System "
    "Dynamics (2004), section 6.5",
    simpler=("input_saturation",),
)
