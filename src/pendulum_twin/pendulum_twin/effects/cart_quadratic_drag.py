"""Drag on the cart that grows with the square of its speed."""

from pendulum_twin.effects.effect import Effect, Form, Parameter, Place, Scale


def law(x, v, th, w, n_s2_m2):
    """Return -c v |v| in N."""
    return -n_s2_m2 * v * abs(v)


EFFECT = Effect(
    name="cart_quadratic_drag",
    place=Place.CART,
    form=Form.FORCE,
    law=law,
    parameters=(
        Parameter(
            "n_s2_m2", "N s^2/m^2", 0.0, 0.0, 1e6, (0.05,), Scale.FORCE, Scale.CART_SPEED, 2
        ),
    ),
    sentence="Drag of {n_s2_m2} times the squared speed holds the cart back.",
    source="drag equation; Batchelor, An Introduction to Fluid Dynamics (1967), section 5.11",
    smooth=True,
    law_kind="cart_force_by_velocity",
)
