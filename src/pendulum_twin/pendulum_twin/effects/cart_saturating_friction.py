"""The thesis's law of cart friction: viscous and dry together, clipped at a limit."""

from pendulum_twin.effects.effect import Effect, Form, Parameter, Place, Scale


def law(speed, x, viscous_n_s_m, level_n, limit_n):
    """Return min(viscous speed + level, limit) in N."""
    return min(viscous_n_s_m * speed + level_n, limit_n)


EFFECT = Effect(
    name="cart_saturating_friction",
    place=Place.CART,
    form=Form.DRY,
    law=law,
    parameters=(
        Parameter(
            "viscous_n_s_m", "N s/m", 0.0, 0.0, 1e6, (0.1, 0.3), Scale.FORCE, Scale.CART_SPEED
        ),
        Parameter("level_n", "N", 0.0, 0.0, 1e6, (0.05,), Scale.FORCE, holds=True),
        Parameter(
            "limit_n", "N", 0.0, 0.0, 1e6, (0.1, 0.25), Scale.FORCE, shape=True, confines=True
        ),
    ),
    sentence="Friction of {level_n} holds the cart back, grows with speed by {viscous_n_s_m} and "
    "levels off at {limit_n}.",
    source="the thesis's simulation: saturate(FS v + FC sign v, +-1 N)",
    simpler=("cart_coulomb_friction",),
    law_kind="cart_dry_friction_by_velocity",
)
