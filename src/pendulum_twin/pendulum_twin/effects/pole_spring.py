"""An encoder cable twists the pole back towards hanging."""

import math

from pendulum_twin.effects.effect import Effect, Form, Parameter, Place, Scale


def law(x, v, th, w, n_m_per_rad):
    """Return -k (th - pi) in N m."""
    return -n_m_per_rad * (th - math.pi)


EFFECT = Effect(
    name="pole_spring",
    place=Place.POLE,
    form=Form.FORCE,
    law=law,
    parameters=(Parameter("n_m_per_rad", "N m/rad", 0.0, -1e6, 1e6, (0.02,), Scale.TORQUE),),
    sentence="Something elastic twists the pole back towards hanging with {n_m_per_rad}.",
    source="Hooke's law",
    smooth=True,
    winds=True,
    law_kind="pole_torque_by_angle",
)
