"""List every effect that a twin may hold and a diagnosis may name, in the order of the chain.

To add an effect, write its file in this folder, import it, and put it into the tuple at its place
(CONTRIBUTING.md has an example).
"""

from __future__ import annotations

from pendulum_twin.effects import (
    angle_offset,
    angle_scale,
    angle_sign_inverted,
    belt_backlash,
    cart_coulomb_friction,
    cart_friction_asymmetry,
    cart_presliding_friction,
    cart_quadratic_drag,
    cart_saturating_friction,
    cart_sign_inverted,
    cart_stribeck_friction,
    cogging,
    eccentric_encoder,
    encoder_slip,
    force_ripple,
    friction_warming,
    gain_asymmetry,
    gain_drift,
    input_dead_zone,
    input_delay,
    input_saturation,
    input_sign_inverted,
    motor_lag,
    periodic_force,
    pole_coulomb_friction,
    pole_imbalance,
    pole_quadratic_drag,
    pole_spring,
    position_scale,
    rail_friction_patch,
    rail_spring,
    rail_tilt,
    sample_period_error,
    sensor_delay,
    soft_saturation,
    stale_start,
    thesis_dead_zones,
    velocity_filter,
)
from pendulum_twin.effects.effect import Effect
from pendulum_twin.user_effects import load_or_stop

BUILT_IN: tuple[Effect, ...] = (
    input_sign_inverted.EFFECT,
    input_delay.EFFECT,
    input_dead_zone.EFFECT,
    input_saturation.EFFECT,
    soft_saturation.EFFECT,
    gain_asymmetry.EFFECT,
    gain_drift.EFFECT,
    motor_lag.EFFECT,
    belt_backlash.EFFECT,
    force_ripple.EFFECT,
    cart_coulomb_friction.EFFECT,
    cart_stribeck_friction.EFFECT,
    cart_saturating_friction.EFFECT,
    cart_presliding_friction.EFFECT,
    friction_warming.EFFECT,
    cart_friction_asymmetry.EFFECT,
    cart_quadratic_drag.EFFECT,
    rail_tilt.EFFECT,
    rail_spring.EFFECT,
    rail_friction_patch.EFFECT,
    cogging.EFFECT,
    periodic_force.EFFECT,
    thesis_dead_zones.EFFECT,
    pole_coulomb_friction.EFFECT,
    pole_quadratic_drag.EFFECT,
    pole_spring.EFFECT,
    pole_imbalance.EFFECT,
    angle_offset.EFFECT,
    eccentric_encoder.EFFECT,
    encoder_slip.EFFECT,
    sensor_delay.EFFECT,
    angle_scale.EFFECT,
    position_scale.EFFECT,
    cart_sign_inverted.EFFECT,
    angle_sign_inverted.EFFECT,
    velocity_filter.EFFECT,
    sample_period_error.EFFECT,
    stale_start.EFFECT,
)
# The user's own effects stand behind the others of the chain: `user_effects`.
CATALOGUE: tuple[Effect, ...] = (*BUILT_IN, *load_or_stop(BUILT_IN))
BY_NAME: dict[str, Effect] = {effect.name: effect for effect in CATALOGUE}
