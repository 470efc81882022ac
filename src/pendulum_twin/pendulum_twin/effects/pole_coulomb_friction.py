"""Dry friction in the pole's bearing."""

from pendulum_twin.effects.effect import Effect, Form, Parameter, Place, Scale


def law(speed, th, level_n_m):
    """Return the level in N m, whatever the rate."""
    return level_n_m


EFFECT = Effect(
    name="pole_coulomb_friction",
    place=Place.POLE,
    form=Form.DRY,
    law=law,
    parameters=(
        Parameter("level_n_m", "N m", 0.0, 0.0, 1e6, (0.01, 0.05), Scale.TORQUE, holds=True),
    ),
    sentence="Dry friction in the bearing holds the pole back with {level_n_m}.",
    source="Armstrong-Helouvry, Dupont and Canudas de Wit, Automatica 30 (1994), table 1",
)
