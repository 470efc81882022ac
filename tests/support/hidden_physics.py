"""Recordings of a rig that hides an effect: wrong constants, noise, encoder steps, fixed seeds."""

from dataclasses import replace

import numpy as np

from pendulum_sysid.records import Recording
from pendulum_twin.arrays import Floats
from pendulum_twin.free_runs import run_freely
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import make_theta
from pendulum_twin.signals import Signals
from support.made_recordings import HANGING, INTECO, PERIOD_S

CART_STEP_M = 57e-6
POLE_STEP_RAD = 2 * np.pi / 4096
OFF = 0.15  # by how much the rig's constants differ from those in the twin file, at most

HIDDEN: dict[str, dict[str, float]] = {
    "input_sign_inverted": {},
    "input_delay": {"delay_s": 0.023},
    "input_dead_zone": {"width": 0.04},
    "coarse_command": {"step": 0.05},
    "input_saturation": {"limit": 0.35},
    "soft_saturation": {"limit": 0.6},
    "gain_asymmetry": {"ratio": 0.06},
    "gain_drift": {"per_s": -0.002},
    "drive_slew_limit": {"ramp_s": 0.4},
    "motor_lag": {"time_constant_s": 0.04},
    "stretching_belt": {"period_s": 0.12, "damping": 0.1},
    "belt_backlash": {"gap_m": 0.002},
    "motor_current_limit": {"limit": 0.3, "counter_share": 0.8},
    "force_ripple": {"ratio": 0.12, "period_m": 0.11, "phase_rad": 0.7},
    "cart_coulomb_friction": {"level_n": 0.5},
    "cart_stribeck_friction": {"level_n": 0.4, "static_n": 0.4, "velocity_m_s": 0.08},
    "cart_saturating_friction": {"viscous_n_s_m": 1.5, "level_n": 0.2, "limit_n": 0.6},
    "cart_presliding_friction": {"level_n": 0.5, "distance_m": 0.004},
    "cart_load_friction": {"coefficient": 0.07},
    "friction_warming": {"level_n": 0.4, "viscous_n_s_m": 1.5, "time_constant_s": 12.0},
    "cart_quadratic_drag": {"n_s2_m2": 1.0},
    "load_put_on": {"load_kg": 0.1, "time_s": 17.3},
    "rail_tilt": {"angle_rad": 0.008},
    "rail_spring": {"n_per_m": 1.0, "centre_m": 0.1},
    "rail_friction_patch": {"level_n": 0.8, "centre_m": 0.05, "width_m": 0.05},
    "rail_drag_patch": {"n_s_per_m": 4.0, "centre_m": 0.05, "width_m": 0.08},
    "cogging": {"amplitude_n": 0.3, "period_m": 0.12, "phase_rad": 1.0},
    "periodic_force": {"amplitude_n": 0.3, "frequency_hz": 4.3, "phase_rad": 0.7},
    "pole_coulomb_friction": {"level_n_m": 0.001},
    "pole_quadratic_drag": {"n_m_s2": 2e-5},
    "pole_spring": {"n_m_per_rad": 0.002},
    "angle_delay": {"delay_s": 0.007},
    "angle_lag": {"time_constant_s": 0.012},
    "angle_offset": {"angle_rad": 0.03},
    "eccentric_encoder": {"sine_rad": 0.03, "cosine_rad": -0.02},
    "eccentric_pulley": {"ratio": 0.1, "period_m": 0.2, "phase_rad": 0.7},
    "encoder_slip": {"angle_rad": 0.05, "time_s": 17.295},
    "angle_scale": {"ratio": 0.02},
    "position_scale": {"ratio": -0.03},
    "velocity_filter": {"time_constant_s": 0.03},
    "cart_sign_inverted": {},
    "angle_sign_inverted": {},
}


def make_command(seed: int, samples: int) -> Floats:
    """Return a sum of sines that swells and fades, with rests in between."""
    random = np.random.default_rng(seed)
    t = np.arange(samples) * PERIOD_S
    sines = [
        np.sin(2 * np.pi * random.uniform(0.3, 2.5) * t + random.uniform(0, 6.28))
        * random.uniform(0.3, 1)
        for _ in range(12)
    ]
    u = np.sum(sines, axis=0)
    u *= (
        0.5
        * (0.25 + 0.75 * np.abs(np.sin(2 * np.pi * t / 23 + random.uniform(0, 3))))
        / np.max(np.abs(u))
    )
    for begin in random.integers(300, samples - 300, 4):
        u[begin : begin + 120] = 0.0
    return u


def record_hidden(
    effects: dict[str, dict[str, float]],
    seed: int,
    seconds: float = 40.0,
    command_seed: int | None = None,
) -> tuple[Recording, Twin]:
    """Return a recording of a rig with these effects, and the twin that the rig really is.

    Its constants are not those of INTECO. Another command_seed moves the same rig by another
    command.
    """
    random = np.random.default_rng(seed)
    rig = replace(INTECO.rig, cart_viscous_n_s_m=2.0, force_per_pwm_n=9.0)
    keys = (
        "cart_viscous_n_s_m",
        "force_per_pwm_n",
        "com_distance_m",
        "pole_inertia_kg_m2",
        "pole_viscous_n_m_s",
    )
    rig = replace(
        rig, **{key: getattr(rig, key) * (1 + OFF * random.uniform(-1, 1)) for key in keys}
    )
    truth = Twin("hidden", rig, effects)
    n = round(seconds / PERIOD_S)
    every = np.ones(n, dtype=bool)
    command = make_command(seed if command_seed is None else command_seed, n)
    blank = Signals(PERIOD_S, command, np.zeros(n), np.zeros(n), every, every)
    zero = np.zeros(1, dtype=np.int64)
    states = run_freely(blank, make_theta(truth)[None], zero, zero, HANGING[None], n)[0]
    cart = np.round((states[:, 0] + random.normal(0, 1e-5, n)) / CART_STEP_M) * CART_STEP_M
    pole = np.round((states[:, 1] + random.normal(0, 1e-4, n)) / POLE_STEP_RAD) * POLE_STEP_RAD
    rates = report_rates(
        np.stack([cart, pole], axis=1),
        effects.get("velocity_filter", {}).get("time_constant_s", 0.0),
    )
    return Recording(
        "hidden", f"sha256:{seed}", replace(blank, cart=cart, pole=pole), rates=rates
    ), truth


def report_rates(positions: Floats, time_constant_s: float) -> Floats:
    """Return the differences of positions (n, 2), through a first-order lag."""
    rates = np.diff(positions, axis=0, prepend=positions[:1]) / PERIOD_S
    keep = np.exp(-PERIOD_S / time_constant_s) if time_constant_s else 0.0
    for n in range(1, len(rates)):
        rates[n] = keep * rates[n - 1] + (1 - keep) * rates[n]
    return rates
