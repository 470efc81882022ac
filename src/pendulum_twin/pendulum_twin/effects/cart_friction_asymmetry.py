"""The cart's dry friction is larger one way than the other."""

from pendulum_twin.effects.effect import Effect, Form, Parameter, Place


def law(direction, ratio):
    """Return 1 + ratio for motion in the positive direction, 1 - ratio for the negative."""
    return 1.0 + ratio * direction


EFFECT = Effect(
    name="cart_friction_asymmetry",
    place=Place.CART,
    form=Form.DRY_RATIO,
    law=law,
    parameters=(Parameter("ratio", "1", 0.0, -1.0, 1.0, (0.2, -0.2)),),
    sentence="The cart's dry friction is larger in the positive direction by {ratio} of its mean, "
    "smaller the other way.",
    source="Armstrong-Helouvry, Dupont and Canudas de Wit, Automatica 30 (1994), section 2: "
    "direction-dependent levels",
    acts_beside="cart_coulomb_friction",
)
