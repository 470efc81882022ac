"""More dry friction on one part of the rail: a dent, dirt, a rail that is bent there."""

from pendulum_twin.effects.effect import Effect, Form, Parameter, Place, Scale
from pendulum_twin.elementary import exp

CENTRES = tuple(0.2 * k for k in range(-4, 5))  # of the travel, from the middle


def law(speed, x, level_n, centre_m, width_m):
    """Return level exp(-((x - centre)/width)^2) in N."""
    off = (x - centre_m) / width_m
    return level_n * exp(-off * off)


EFFECT = Effect(
    name="rail_friction_patch",
    place=Place.CART,
    form=Form.DRY,
    law=law,
    parameters=(
        Parameter("level_n", "N", 0.0, 0.0, 1e6, (0.1,), Scale.FORCE),
        Parameter(
            "centre_m", "m", 0.0, -1e2, 1e2, CENTRES, Scale.CART_TRAVEL, shape=True, most=1.2
        ),
        Parameter(
            "width_m",
            "m",
            1.0,
            1e-3,
            1e2,
            (0.1, 0.25, 0.5),
            Scale.CART_TRAVEL,
            shape=True,
            most=1.0,
            fewest=0.03,
            confines=True,
        ),
    ),
    sentence="Dry friction is larger by {level_n} around {centre_m} of the rail, over a width of "
    "{width_m}.",
    source="position-dependent friction; Armstrong-Helouvry, Dupont and Canudas de Wit, "
    "Automatica 30 (1994), section 2.2",
    becomes=("cart_coulomb_friction",),
    law_kind="cart_dry_friction_along_rail",
)
