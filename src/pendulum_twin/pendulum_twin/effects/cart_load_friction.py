"""Dry friction of the cart that grows with the load on its guide, which the pole changes.

The pole presses the cart down where it hangs and whirls, and lifts it where it whirls upright.
"""

from pendulum_twin.effects.effect import Effect, Form, Parameter, Place
from pendulum_twin.elementary import sin_cos


def law(th, w, mass_kg, moment_kg_m, inertia_kg_m2, gravity_m_s2, coefficient):
    """Return coefficient |N| in N; N = m g - S (w^2 cos th + w' sin th), the load on the rail.

    w' is what its weight gives the pole; what the cart's acceleration adds to it is left out.
    """
    sine, cosine = sin_cos(th)
    turning = moment_kg_m * gravity_m_s2 * sine / inertia_kg_m2
    load = mass_kg * gravity_m_s2 - moment_kg_m * (w * w * cosine + turning * sine)
    return coefficient * abs(load)


EFFECT = Effect(
    name="cart_load_friction",
    place=Place.CART,
    form=Form.STATE_FRICTION,
    law=law,
    needs_both_joints=True,  # without a pole the load is constant: Coulomb friction
    constants=("mass_kg", "moment_kg_m", "inertia_kg_m2", "gravity_m_s2"),
    parameters=(Parameter("coefficient", "1", 0.0, 0.0, 10.0, (0.02, 0.1)),),
    sentence="Dry friction holds the cart back with {coefficient} of the load on its guide, which "
    "the whirling pole raises and lowers.",
    source="Amontons' law with the normal force of cart and pole; S. A. Campbell, S. Crawford and "
    "K. Morris, Journal of Dynamic Systems, Measurement, and Control 130 (2008) 054502",
)
