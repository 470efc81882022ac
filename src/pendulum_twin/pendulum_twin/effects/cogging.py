"""A force that repeats along the rail: a motor's cogging, an eccentric pulley, belt teeth."""

from pendulum_twin.effects.effect import Effect, Form, Parameter, Place, Scale
from pendulum_twin.elementary import sin_cos

PERIODS = tuple(1.0 / 1.13**k for k in range(28))  # of half the stroke
PHASES = tuple(0.7853981633974483 * k for k in range(-4, 4))


def law(x, v, th, w, amplitude_n, period_m, phase_rad):
    """Return amplitude sin(2 pi x / period + phase) in N."""
    return amplitude_n * sin_cos(6.283185307179586 * x / period_m + phase_rad)[0]


EFFECT = Effect(
    name="cogging",
    place=Place.CART,
    form=Form.FORCE,
    law=law,
    parameters=(
        Parameter("amplitude_n", "N", 0.0, 0.0, 1e6, (0.02,), Scale.FORCE),
        Parameter(
            "period_m",
            "m",
            1.0,
            1e-4,
            100.0,
            PERIODS,
            Scale.CART_TRAVEL,
            shape=True,
            most=1.0,
            fewest=0.03,
        ),
        Parameter("phase_rad", "rad", 0.0, -10.0, 10.0, PHASES, shape=True, phase=True),
    ),
    sentence="A force of {amplitude_n} repeats every {period_m} along the rail (phase "
    "{phase_rad}).",
    source="first harmonic of cogging torque; Hanselman, Brushless Permanent Magnet Motor Design "
    "(2003), chapter 7",
    becomes=("rail_tilt", "rail_spring"),
    law_kind="cart_force_by_position",
)
