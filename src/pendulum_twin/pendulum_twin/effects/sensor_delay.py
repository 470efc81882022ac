"""What is reported is some time old.

The state is kept in the sensor's time: seen from there everything happens that much later, so the
command comes late and nothing else changes, for no other effect asks for the hour.
"""

from pendulum_twin.effects.effect import HALF_STEP_S, Effect, Form, Parameter, Place
from pendulum_twin.effects.input_delay import LONGEST_S, law, memory

EFFECT = Effect(
    name="sensor_delay",
    place=Place.SENSOR,
    form=Form.FILTER,
    law=law,
    memory=memory,
    parameters=(
        Parameter(
            "delay_s", "s", 0.0, 0.0, LONGEST_S, (0.01, 0.04), least=HALF_STEP_S, delays=True
        ),
    ),
    sentence="Positions are reported {delay_s} late.",
    source="pure transport delay; Ljung, System Identification (1999), section 4.2",
    shows_as="input_delay",
    smooth=True,
    separated_by="a second clock would: record the drive's own current beside the positions",
)
