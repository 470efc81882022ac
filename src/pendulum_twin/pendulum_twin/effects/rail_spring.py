"""A cable or a belt pulls the cart towards one place of the rail."""

from pendulum_twin.effects.effect import Effect, Form, Parameter, Place, Scale


def law(x, v, th, w, n_per_m, centre_m):
    """Return -k (x - centre) in N."""
    return -n_per_m * (x - centre_m)


EFFECT = Effect(
    name="rail_spring",
    place=Place.CART,
    form=Form.FORCE,
    law=law,
    parameters=(
        Parameter("n_per_m", "N/m", 0.0, -1e6, 1e6, (0.1,), Scale.FORCE, Scale.CART_TRAVEL),
        Parameter(
            "centre_m", "m", 0.0, -10.0, 10.0, (-1.0, 0.0, 1.0), Scale.CART_TRAVEL, shape=True
        ),
    ),
    sentence="Something elastic pulls the cart towards {centre_m} with {n_per_m}.",
    source="Hooke's law",
    simpler=("rail_tilt",),
    smooth=True,
    law_kind="cart_force_by_position",
)
