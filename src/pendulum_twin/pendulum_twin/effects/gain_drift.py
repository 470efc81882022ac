"""The drive's gain changes during the recording: a motor that warms up, a battery that sags.

A live twin may run for hours after a recording of a minute: a gain that falls ends at LEAST_GAIN,
and never turns the drive round, and a gain that rises ends at MOST_GAIN.
"""

from pendulum_twin.effects.effect import Effect, Form, Parameter, Place, Scale

# Of the first gain. A drive fades no further, and is not asked for ever more.
LEAST_GAIN = 0.1
MOST_GAIN = 1.0 / LEAST_GAIN  # it grows no further than it may fade


def law(u, memory, h, t, per_s):
    """Return u times (1 + per_s t), t counted from the start, between LEAST_GAIN and MOST_GAIN."""
    return u * min(max(1.0 + per_s * t, LEAST_GAIN), MOST_GAIN)


def inverse(u, t, per_s):
    """Return u over (1 + per_s t), which lies between LEAST_GAIN and MOST_GAIN."""
    return u / min(max(1.0 + per_s * t, LEAST_GAIN), MOST_GAIN)


EFFECT = Effect(
    name="gain_drift",
    place=Place.COMMAND,
    form=Form.FILTER,
    law=law,
    inverse=inverse,
    memory=lambda h: 0,
    parameters=(Parameter("per_s", "1/s", 0.0, -1.0, 1.0, (0.05,), Scale.ONE, Scale.SECONDS),),
    sentence="The drive's gain changes by {per_s} of its first value.",
    source="first term of a gain that varies in time; Ljung, System Identification (1999), "
    "section 5.2",
    timed=True,
    law_kind="drive_gain_over_time",
)
