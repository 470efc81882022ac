"""Dry friction of the cart that is larger at rest and falls to its level with rising speed."""

from pendulum_twin.effects.effect import Effect, Form, Parameter, Place, Scale
from pendulum_twin.elementary import exp


def law(speed, x, level_n, static_n, velocity_m_s):
    """Return level + static exp(-(speed/velocity)^2) in N."""
    r = speed / velocity_m_s
    return level_n + static_n * exp(-r * r)


EFFECT = Effect(
    name="cart_stribeck_friction",
    place=Place.CART,
    form=Form.DRY,
    law=law,
    parameters=(
        Parameter("level_n", "N", 0.0, 0.0, 1e6, (0.05,), Scale.FORCE, holds=True),
        Parameter("static_n", "N", 0.0, 0.0, 1e6, (0.05,), Scale.FORCE, holds=True),
        Parameter(
            "velocity_m_s",
            "m/s",
            0.05,
            1e-4,
            1e3,
            (0.1, 0.4),
            Scale.CART_SPEED,
            shape=True,
            confines=True,
        ),
    ),
    sentence="Dry friction of {level_n} holds the cart back, with {static_n} more at rest that "
    "fades around {velocity_m_s}.",
    source="Armstrong-Helouvry, Dupont and Canudas de Wit, Automatica 30 (1994), equation for the "
    "Stribeck curve, Gaussian form",
    simpler=("cart_coulomb_friction",),
    law_kind="cart_dry_friction_by_velocity",
)
