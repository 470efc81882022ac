"""The drive's gain changes during the recording: a motor that warms up, a battery that sags."""

from pendulum_twin.effects.effect import Effect, Form, Parameter, Place, Scale

LEAST_GAIN = 0.1  # of the first: a drive that has faded further is not asked for ever more


def law(u, memory, h, t, per_s):
    """Return u times (1 + per_s t), t counted from the start of the recording."""
    return u * (1.0 + per_s * t)


def inverse(u, t, per_s):
    """Return u over (1 + per_s t), the gain being taken for LEAST_GAIN at least."""
    return u / max(1.0 + per_s * t, LEAST_GAIN)


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
