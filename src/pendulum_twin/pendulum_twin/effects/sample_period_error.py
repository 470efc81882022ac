"""The recorder's clock is wrong: its stamps run faster or slower than time."""

from pendulum_twin.effects.effect import Effect, Form, Parameter, Place


def law(ratio):
    """Return how much time passes while the stamps go on by one second."""
    return 1.0 / (1.0 + ratio)


EFFECT = Effect(
    name="sample_period_error",
    place=Place.CLOCK,
    form=Form.CLOCK,
    law=law,
    parameters=(Parameter("ratio", "1", 0.0, -0.5, 1.0, (0.01,)),),
    sentence="The stamps run too fast by {ratio} of their pace.",
    source="rate error of a clock; the pole's weight is what shows it, for g is known",
    shows_as="position_scale",
    shows_as_with=(
        "com_distance_m",
        "pole_inertia_kg_m2",
        "cart_viscous_n_s_m",
        "pole_viscous_n_m_s",
    ),
    smooth=True,
    needs_both_joints=True,
    separated_by="a ruler along the cart's stroke would, or a watch beside a long recording",
)
