"""The force per command ripples along the rail: poles of a motor, a pulley that is worn.

Unlike `cogging`, nothing of it is there without a command.
"""

from pendulum_twin.effects.cogging import PERIODS, PHASES
from pendulum_twin.effects.effect import Effect, Form, Parameter, Place, Scale
from pendulum_twin.elementary import sin_cos


def law(x, ratio, period_m, phase_rad):
    """Return 1 + ratio sin(2 pi x / period + phase)."""
    return 1.0 + ratio * sin_cos(6.283185307179586 * x / period_m + phase_rad)[0]


EFFECT = Effect(
    name="force_ripple",
    place=Place.DRIVE,
    form=Form.GAIN,
    law=law,
    parameters=(
        Parameter("ratio", "1", 0.0, 0.0, 0.9, (0.1,)),
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
    sentence="The force per command goes up and down by {ratio} of itself every {period_m} along "
    "the rail (phase {phase_rad}).",
    source="first harmonic of a motor's torque ripple; Hanselman, Brushless Permanent Magnet "
    "Motor Design (2003)",
    law_kind="drive_gain_along_rail",
)
