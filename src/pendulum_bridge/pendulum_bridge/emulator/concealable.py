"""The effects that an emulated rig can conceal, and their realistic sizes.

Names and parameters are the catalogue's, so that a verdict can be compared with them. The physics
is this package's own: `drive.py` before the force; `mjcf.py`, `friction.py` and `laws.py` in the
mechanics; `sensors.py` behind them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from pendulum_twin.effects import BY_NAME as EFFECTS

Span = tuple[float, float]


@dataclass(frozen=True)
class Concealable:
    """Give the realistic sizes of one effect.

    name: of the effect, as the catalogue has it.
    family: of effects of the same family at most one is drawn, because together they mean nothing
        or no motion can tell them apart.
    sizes: parameter name -> lowest and highest size drawn (unit: see the parameter's name).
    both_ways: whether the sign of the size is drawn too.
    shapes: parameters that say where or how, not how much; sign and size factor leave them alone.
    neutral: the size at which the effect vanishes.
    beside: effects of which one must be there for this effect to mean anything.
    rests: whether a rig with the effect can come to rest, as a live rig has to.
    ages: whether its sizes are of the rig's start; the recording of a live rig begins later.
    """

    name: str
    family: str
    sizes: Mapping[str, Span]
    both_ways: bool = False
    shapes: tuple[str, ...] = ()
    neutral: float = 0.0
    beside: tuple[str, ...] = ()
    rests: bool = True
    ages: bool = False

    @property
    def is_of_recording(self) -> bool:
        """Return whether the effect belongs to one recording; a live rig cannot have it."""
        return EFFECTS[self.name].of_recording

    @property
    def is_of_live_rig(self) -> bool:
        """Return whether a live rig can conceal it: it rests, and keeps what the seal says."""
        return self.rests and not self.ages and not self.is_of_recording


DRY_FRICTIONS = ("cart_coulomb_friction", "cart_stribeck_friction", "cart_saturating_friction")
ANGLE_SIZES_RAD = (0.03, 0.15)  # rad

# Sizes for a rig of 0.7 kg, 6.4 N and a pole of 0.13 N m that swings at up to some 15 rad/s.
TABLE: tuple[Concealable, ...] = (
    Concealable("input_sign_inverted", "sign", {}),
    Concealable("input_delay", "time", {"delay_s": (0.01, 0.05)}),
    Concealable("input_dead_zone", "dead zone", {"width": (0.015, 0.06)}),
    Concealable("input_saturation", "saturation", {"limit": (0.22, 0.38)}, neutral=0.5),
    Concealable("gain_asymmetry", "asymmetry", {"ratio": (0.04, 0.2)}, both_ways=True),
    Concealable("gain_drift", "drift", {"per_s": (0.001, 0.004)}, both_ways=True, ages=True),
    Concealable("motor_lag", "time", {"time_constant_s": (0.015, 0.08)}),
    Concealable("belt_backlash", "slack", {"gap_m": (0.0015, 0.008)}),
    Concealable("cart_coulomb_friction", "cart friction", {"level_n": (0.25, 1.2)}),
    Concealable(
        "cart_stribeck_friction",
        "cart friction",
        {"level_n": (0.25, 0.8), "static_n": (0.25, 0.8), "velocity_m_s": (0.05, 0.2)},
        shapes=("velocity_m_s",),
    ),
    Concealable(
        "cart_saturating_friction",
        "cart friction",
        {"viscous_n_s_m": (1.0, 4.0), "level_n": (0.15, 0.4), "limit_n": (0.7, 1.1)},
    ),
    Concealable(
        "cart_friction_asymmetry",
        "friction asymmetry",
        {"ratio": (0.15, 0.4)},
        both_ways=True,
        beside=DRY_FRICTIONS,
    ),
    Concealable("cart_quadratic_drag", "cart drag", {"n_s2_m2": (0.4, 1.6)}),
    Concealable("rail_tilt", "bias", {"angle_rad": (0.008, 0.03)}, both_ways=True),
    Concealable(
        "rail_spring",
        "bias",
        {"n_per_m": (0.5, 2.0), "centre_m": (-0.1, 0.1)},
        shapes=("centre_m",),
    ),
    Concealable(
        "rail_friction_patch",
        "friction patch",
        {"level_n": (0.5, 1.5), "centre_m": (-0.2, 0.2), "width_m": (0.05, 0.15)},
        shapes=("centre_m", "width_m"),
    ),
    Concealable(
        "cogging",
        "cogging",
        {"amplitude_n": (0.2, 0.6), "period_m": (0.03, 0.15), "phase_rad": (-3.0, 3.0)},
        shapes=("period_m", "phase_rad"),
    ),
    Concealable("pole_coulomb_friction", "pole friction", {"level_n_m": (0.0008, 0.004)}),
    Concealable("pole_quadratic_drag", "pole drag", {"n_m_s2": (1.5e-5, 6e-5)}),
    Concealable("pole_spring", "pole bias", {"n_m_per_rad": (0.002, 0.008)}),
    Concealable("pole_imbalance", "pole bias", {"angle_rad": ANGLE_SIZES_RAD}, both_ways=True),
    Concealable("angle_offset", "pole bias", {"angle_rad": ANGLE_SIZES_RAD}, both_ways=True),
    Concealable(
        "encoder_slip",
        "slip",
        {"angle_rad": ANGLE_SIZES_RAD, "time_s": (12.0, 35.0)},
        both_ways=True,
        shapes=("time_s",),
    ),
    Concealable("sensor_delay", "time", {"delay_s": (0.01, 0.05)}),
    Concealable("angle_delay", "angle time", {"delay_s": (0.004, 0.02)}),
    Concealable("angle_scale", "angle scale", {"ratio": (0.02, 0.08)}, both_ways=True),
    Concealable("position_scale", "pace", {"ratio": (0.03, 0.1)}, both_ways=True),
    Concealable("cart_sign_inverted", "sign", {}),
    Concealable("angle_sign_inverted", "sign", {}),
    Concealable("velocity_filter", "velocities", {"time_constant_s": (0.02, 0.08)}),
    Concealable("sample_period_error", "pace", {"ratio": (0.02, 0.06)}, both_ways=True),
    Concealable("stale_start", "beginning", {"seconds": (0.5, 2.0)}),
    Concealable(
        "eccentric_encoder",
        "encoder disc",
        {"sine_rad": (-0.1, 0.1), "cosine_rad": (0.03, 0.1)},
        both_ways=True,
    ),
    Concealable(
        "force_ripple",
        "force ripple",
        {"ratio": (0.1, 0.3), "period_m": (0.06, 0.2), "phase_rad": (-3.0, 3.0)},
        shapes=("period_m", "phase_rad"),
    ),
    Concealable(
        "periodic_force",
        "vibration",
        {"amplitude_n": (0.3, 0.8), "frequency_hz": (2.0, 8.0), "phase_rad": (-3.0, 3.0)},
        shapes=("frequency_hz", "phase_rad"),
        rests=False,
    ),
    Concealable("soft_saturation", "saturation", {"limit": (0.35, 0.6)}, neutral=2.0),
    Concealable(
        "friction_warming",
        "warming",
        {"level_n": (0.3, 0.8), "viscous_n_s_m": (1.0, 3.0), "time_constant_s": (8.0, 20.0)},
        shapes=("time_constant_s",),
        ages=True,
    ),
    Concealable(
        "cart_presliding_friction",
        "cart friction",
        {"level_n": (0.25, 0.8), "distance_m": (0.002, 0.006)},
        shapes=("distance_m",),
    ),
    Concealable("cart_load_friction", "cart friction", {"coefficient": (0.04, 0.12)}),
    Concealable("coarse_command", "command steps", {"step": (0.04, 0.08)}),
    Concealable(
        "rail_drag_patch",
        "drag patch",
        {"n_s_per_m": (3.0, 8.0), "centre_m": (-0.1, 0.1), "width_m": (0.05, 0.12)},
        shapes=("centre_m", "width_m"),
    ),
    Concealable(
        "eccentric_pulley",
        "pulley",
        {"ratio": (0.06, 0.2), "period_m": (0.06, 0.15), "phase_rad": (-3.0, 3.0)},
        shapes=("period_m", "phase_rad"),
    ),
    Concealable(
        "load_put_on",
        "load",
        {"load_kg": (0.08, 0.25), "time_s": (12.0, 35.0)},
        both_ways=True,
        shapes=("time_s",),
    ),
    Concealable(
        "stretching_belt",
        "time",
        {"period_s": (0.04, 0.08), "damping": (0.05, 0.2), "motor_share": (0.05, 0.2)},
        shapes=("damping", "motor_share"),
    ),
    Concealable("drive_slew_limit", "slew", {"ramp_s": (0.1, 0.3)}),  # slower: plans brake late
    Concealable("drive_offset", "bias", {"offset": (0.004, 0.016)}, both_ways=True),
    Concealable("angle_lag", "angle time", {"time_constant_s": (0.004, 0.02)}),
    Concealable(
        "motor_current_limit",
        "saturation",
        {"limit": (0.22, 0.38), "counter_share": (0.5, 0.9)},
        shapes=("limit",),
    ),
)
# Entries that were there first: a seed orders them by a single draw. Later entries are put between
# them, each by a draw of its own, so that most seeds conceal what they always concealed.
FIRST_ENTRIES = 31
BY_NAME = {entry.name: entry for entry in TABLE}
