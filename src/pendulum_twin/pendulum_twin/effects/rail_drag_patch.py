"""Viscous drag on one part of the rail: an eddy-current brake, a seal, grease that gathered."""

from pendulum_twin.effects.effect import Effect, Form, Parameter, Place, Scale
from pendulum_twin.effects.rail_friction_patch import CENTRES
from pendulum_twin.elementary import exp


def law(x, v, th, w, n_s_per_m, centre_m, width_m):
    """Return -c exp(-((x - centre)/width)^2) v in N."""
    off = (x - centre_m) / width_m
    return -n_s_per_m * exp(-off * off) * v


EFFECT = Effect(
    name="rail_drag_patch",
    place=Place.CART,
    form=Form.FORCE,
    law=law,
    parameters=(
        Parameter("n_s_per_m", "N s/m", 0.0, 0.0, 1e6, (0.1,), Scale.FORCE, Scale.CART_SPEED),
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
    sentence="Viscous drag is larger by {n_s_per_m} around {centre_m} of the rail, over a width "
    "of {width_m}.",
    source="eddy-current brake at low speed, whose drag grows with the speed; H. D. Wiederick, "
    "N. Gauthier, D. A. Campbell and P. Rochon, American Journal of Physics 55 (1987) 500",
    law_kind="cart_drag_along_rail",
)
