"""The cart's friction falls while the rig warms up: grease that is stiff at first.

The friction of the warm rig is not part of the effect: `cart_viscous_n_s_m` and
`cart_coulomb_friction` hold it.
"""

from pendulum_twin.effects.effect import Effect, Form, Parameter, Place, Scale
from pendulum_twin.elementary import exp


def law(t, level_n, viscous_n_s_m, time_constant_s):
    """Return what is left at a time of the friction that warms away: dry, N; viscous, N s/m."""
    cold = exp(-t / time_constant_s)
    return level_n * cold, viscous_n_s_m * cold


EFFECT = Effect(
    name="friction_warming",
    place=Place.CART,
    form=Form.TIMED_FRICTION,
    law=law,
    parameters=(
        Parameter("level_n", "N", 0.0, 0.0, 1e6, (0.05,), Scale.FORCE),
        Parameter("viscous_n_s_m", "N s/m", 0.0, 0.0, 1e6, (0.05,), Scale.FORCE, Scale.CART_SPEED),
        Parameter(
            "time_constant_s",
            "s",
            10.0,
            1e-2,
            1e5,
            (0.1, 0.3, 1.0),
            Scale.SECONDS,
            shape=True,
            most=2.0,
            fewest=0.02,
        ),
    ),
    sentence="At first the cart has dry friction of {level_n} and viscous friction of "
    "{viscous_n_s_m} more; both warm away with the time constant {time_constant_s}.",
    source="friction that falls with its temperature, which rises as a first-order lag",
    becomes=("cart_coulomb_friction",),
    timed=True,
    law_kind="cart_dry_friction_over_time",
)
