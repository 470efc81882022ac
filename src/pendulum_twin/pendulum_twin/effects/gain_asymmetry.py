"""The drive is stronger one way than the other."""

from pendulum_twin.effects.effect import Effect, Form, Parameter, Place


def law(u, memory, h, t, ratio):
    """Return u times (1 + ratio) when positive, times (1 - ratio) when negative."""
    return u * (1.0 + ratio) if u > 0.0 else u * (1.0 - ratio)


def inverse(u, t, ratio):
    """Return u over (1 + ratio) when positive, over (1 - ratio) when negative."""
    return u / (1.0 + ratio) if u > 0.0 else u / (1.0 - ratio)


EFFECT = Effect(
    name="gain_asymmetry",
    place=Place.COMMAND,
    form=Form.FILTER,
    law=law,
    inverse=inverse,
    memory=lambda h: 0,
    parameters=(Parameter("ratio", "1", 0.0, -0.9, 0.9, (0.05,)),),
    sentence="Positive commands act {ratio} (as a fraction) stronger than the mean, negative ones "
    "weaker.",
    source="two-slope static gain; Janczak, Identification of Nonlinear Systems (2005), chapter 1",
    law_kind="command_curve",
)
