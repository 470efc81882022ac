"""The rail is not level: gravity pulls the cart to one side."""

from pendulum_twin.effects.effect import Effect, Form, Parameter, Place


def law(x, v, th, w, mass_kg, gravity_m_s2, angle_rad):
    """Return m g angle in N, for small angles; positive angles pull the cart the positive way."""
    return mass_kg * gravity_m_s2 * angle_rad


EFFECT = Effect(
    name="rail_tilt",
    place=Place.CART,
    form=Form.FORCE,
    law=law,
    constants=("mass_kg", "gravity_m_s2"),
    parameters=(Parameter("angle_rad", "rad", 0.0, -0.5, 0.5, (0.01,)),),
    sentence="The rail is tilted by {angle_rad}.",
    source="weight on an incline, small angle",
    smooth=True,
    law_kind="cart_force_by_position",
)
