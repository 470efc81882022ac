"""A force on the cart that repeats in time, whatever the rig does: something nearby vibrates."""

from pendulum_twin.effects.effect import Effect, Form, Parameter, Place, Scale
from pendulum_twin.elementary import sin_cos


def law(t, amplitude_n, frequency_hz, phase_rad):
    """Return amplitude sin(2 pi frequency t + phase) in N; t from the recording's start."""
    return amplitude_n * sin_cos(6.283185307179586 * frequency_hz * t + phase_rad)[0]


EFFECT = Effect(
    name="periodic_force",
    place=Place.CART,
    form=Form.TIMED_FORCE,
    law=law,
    parameters=(
        Parameter("amplitude_n", "N", 0.0, 0.0, 1e6, (0.05,), Scale.FORCE),
        # typical: so many periods in the recording; the fewest are two
        Parameter(
            "frequency_hz",
            "Hz",
            1.0,
            1e-4,
            1e3,
            (20.0, 60.0, 200.0),
            Scale.ONE,
            Scale.SECONDS,
            shape=True,
            fewest=2.0,
        ),
        Parameter(
            "phase_rad",
            "rad",
            0.0,
            -10.0,
            10.0,
            (0.0, 1.5707963267948966),
            shape=True,
            phase=True,
        ),
    ),
    sentence="A force of {amplitude_n} repeats at {frequency_hz} whatever the rig does (phase "
    "{phase_rad}): something vibrates.",
    source="first harmonic of a disturbance that is periodic in time",
    timed=True,
)
