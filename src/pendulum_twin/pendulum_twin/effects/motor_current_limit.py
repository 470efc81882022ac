"""The amplifier limits the motor's current: the force is limited, the earlier against the motion.

A voltage drives a current against the motor's counter voltage, which grows with the speed. Below
the limit the counter voltage is viscous friction. At the limit the force no longer depends on it.
"""

from pendulum_twin.effects.effect import Effect, Form, Parameter, Place, Scale


def law(force, v, force_per_pwm_n, cart_viscous_n_s_m, limit, counter_share):
    """Return the drive's force, N, and what is added to the cart's viscous friction, N s/m.

    Below the limit both stay. At the limit the counter voltage's share of the friction is gone,
    and no more: a limit that took more would drive the cart.
    """
    counter = min(counter_share, 1.0) * cart_viscous_n_s_m
    current = force - counter * v
    most = limit * force_per_pwm_n
    if current > most:
        return most, -counter
    if current < -most:
        return -most, -counter
    return force, 0.0


EFFECT = Effect(
    name="motor_current_limit",
    place=Place.DRIVE,
    form=Form.DRIVE,
    law=law,
    constants=("force_per_pwm_n", "cart_viscous_n_s_m"),
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
        # Where all friction is the motor's, a fit may err to the far side of 1; the law stays.
        Parameter("counter_share", "1", 0.0, 0.0, 2.0, (0.6,), shape=True),
    ),
    sentence="The motor's current is limited as by a command of {limit}, and {counter_share} of "
    "the cart's viscous friction is the motor's counter voltage.",
    source="permanent-magnet motor behind an amplifier with a current limit; K. Ogata, System "
    "Dynamics (2004), section 6.5",
    simpler=("input_saturation",),
)
