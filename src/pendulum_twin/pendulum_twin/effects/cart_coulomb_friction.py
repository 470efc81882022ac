"""Dry friction of the cart: one level against the motion, and up to that level at rest."""

from pendulum_twin.effects.effect import Effect, Form, Parameter, Place, Scale


def law(speed, x, level_n):
    """Return the level in N, whatever the speed."""
    return level_n


EFFECT = Effect(
    name="cart_coulomb_friction",
    place=Place.CART,
    form=Form.DRY,
    law=law,
    parameters=(Parameter("level_n", "N", 0.0, 0.0, 1e6, (0.03, 0.15), Scale.FORCE, holds=True),),
    sentence="Dry friction holds the cart back with {level_n}.",
    source="Armstrong-Helouvry, Dupont and Canudas de Wit, Automatica 30 (1994), table 1",
)
