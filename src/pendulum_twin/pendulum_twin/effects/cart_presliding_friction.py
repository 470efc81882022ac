"""Dry friction of the cart that gives way elastically: the contact bends before it slips.

The friction is a state. It follows the way of the cart, whatever the speed: over a small way after
each reversal it is a spring, and far from a reversal it is `cart_coulomb_friction`.
"""

from pendulum_twin.effects.effect import Effect, Form, Parameter, Place, Scale
from pendulum_twin.elementary import exp


def law(force, move, level_n, distance_m):
    """Return the friction in N after a move of the cart in m, from the friction before it.

    dF/dx = -(level + F sign(dx)) / distance, solved over a move in one direction.
    """
    slipping = -level_n if move > 0.0 else level_n
    return slipping + (force - slipping) * exp(-abs(move) / distance_m)


EFFECT = Effect(
    name="cart_presliding_friction",
    place=Place.CART,
    form=Form.PATH_FORCE,
    law=law,
    parameters=(
        Parameter("level_n", "N", 0.0, 0.0, 1e6, (0.03, 0.15), Scale.FORCE),
        # a stiffness level / distance that a step of the kernel resolves, on any believable cart
        Parameter(
            "distance_m",
            "m",
            1e-3,
            1e-5,
            1e-1,
            (0.003, 0.01, 0.03),
            Scale.CART_TRAVEL,
            shape=True,
            most=0.05,
        ),
    ),
    sentence="Dry friction of {level_n} holds the cart back and is elastic at first: after a "
    "reversal it grows over a distance of {distance_m}.",
    source="P. R. Dahl, A solid friction model, Aerospace Corporation TOR-0158(3107-18)-1 (1968), "
    "with exponent 1; Astrom and Canudas de Wit, IEEE Control Systems Magazine 28 (2008) 101, "
    "equation 1",
    simpler=("cart_coulomb_friction",),
    law_kind="cart_hysteresis",
)
