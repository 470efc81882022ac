"""The catalogue: every effect that a twin may hold and a diagnosis may name, in the order of the chain.

To add one: write its file beside this one, import it, put it into the tuple at its place.
"""

from __future__ import annotations

from pendulum_twin.effects import (
    angle_offset,
    angle_sign_inverted,
    cart_coulomb_friction,
    cart_friction_asymmetry,
    cart_quadratic_drag,
    cart_saturating_friction,
    cart_sign_inverted,
    cart_stribeck_friction,
    cogging,
    gain_asymmetry,
    gain_drift,
    input_dead_zone,
    input_delay,
    input_saturation,
    input_sign_inverted,
    motor_lag,
    pole_coulomb_friction,
    pole_quadratic_drag,
    pole_spring,
    rail_spring,
    rail_tilt,
    thesis_dead_zones,
)
from pendulum_twin.effects.effect import Effect

CATALOGUE: tuple[Effect, ...] = (
    input_sign_inverted.EFFECT,
    input_delay.EFFECT,
    input_dead_zone.EFFECT,
    input_saturation.EFFECT,
    gain_asymmetry.EFFECT,
    gain_drift.EFFECT,
    motor_lag.EFFECT,
    cart_coulomb_friction.EFFECT,
    cart_stribeck_friction.EFFECT,
    cart_saturating_friction.EFFECT,
    cart_friction_asymmetry.EFFECT,
    cart_quadratic_drag.EFFECT,
    rail_tilt.EFFECT,
    rail_spring.EFFECT,
    cogging.EFFECT,
    thesis_dead_zones.EFFECT,
    pole_coulomb_friction.EFFECT,
    pole_quadratic_drag.EFFECT,
    pole_spring.EFFECT,
    angle_offset.EFFECT,
    cart_sign_inverted.EFFECT,
    angle_sign_inverted.EFFECT,
)
BY_NAME: dict[str, Effect] = {effect.name: effect for effect in CATALOGUE}
