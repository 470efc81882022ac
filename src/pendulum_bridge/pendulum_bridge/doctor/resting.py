"""The checks of a rig at PWM 0: whether it stands still, and how cleanly it measures.

Samples are arrays (n, 4) in the protocol's order: pole angle (rad), pole rate (rad/s), cart
position (m), cart velocity (m/s).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from pendulum_bridge.doctor.faults import Fault
from pendulum_bridge.doctor.findings import Check, Finding
from pendulum_bridge.safety.reset import Rest
from pendulum_twin.arrays import Floats

POLE, POLE_RATE, CART, CART_VELOCITY = range(4)
REST = Rest()  # limits of rest, as the reset has them
WINDOW = 5  # samples of the running median; spikes are shorter than half of it
MOVED_RAD, MOVED_M = 0.05, 0.005
NOISE_RAD, NOISE_M = 0.01, 0.001  # standard deviation from sample to sample
SPIKE_RAD, SPIKE_M = 0.05, 0.005
WRAP_NEAR_RAD = 0.3  # a jump so near a whole turn is that of a wrapped angle


@dataclass(frozen=True)
class AtRest:
    """Hold the medians of the samples at rest.

    wrapped: whether the angle jumps by whole turns.
    """

    pole_rad: float
    pole_rad_s: float
    cart_m: float
    cart_m_s: float
    wrapped: bool


def measure_rest(samples: Floats) -> AtRest:
    """Return the medians of samples (n, 4), n at least 1."""
    pole, pole_rate, cart, cart_velocity = np.median(samples, axis=0).tolist()
    return AtRest(pole, pole_rate, cart, cart_velocity, has_wraps(samples[:, POLE]))


def has_wraps(angles: Floats) -> bool:
    """Return whether angles (n,) jump by a whole turn, and stay inside a turn."""
    jumps = np.abs(np.abs(np.diff(angles)) - math.tau) < WRAP_NEAR_RAD
    return bool(jumps.any() and np.ptp(angles) < math.tau + WRAP_NEAR_RAD)


def compute_running_median(values: Floats) -> Floats:
    """Return the running median of values (n, ...) along the first axis; the ends are repeated."""
    half = WINDOW // 2
    padding = [(half, half), *[(0, 0)] * (values.ndim - 1)]
    padded = np.pad(values, padding, mode="edge")
    return np.median(sliding_window_view(padded, WINDOW, axis=0), axis=-1)


def check_rest(samples: Floats) -> Finding:
    """Return whether cart and pole stand still."""
    pole, cart = (
        np.ptp(np.percentile(compute_running_median(values), [5, 95]))
        for values in _unwrap_positions(samples)
    )
    fault = Fault.MOVING if pole > MOVED_RAD or cart > MOVED_M else None
    expected = f"under {MOVED_RAD:g} rad and {1e3 * MOVED_M:g} mm of motion at PWM 0"
    return Finding(Check.REST, expected, f"{pole:.4f} rad and {1e3 * cart:.2f} mm", fault)


def check_noise(samples: Floats) -> Finding:
    """Return whether the positions are measured cleanly, and the encoders' steps."""
    pole, cart = _unwrap_positions(samples)
    spikes = _find_spikes(pole, SPIKE_RAD) | _find_spikes(cart, SPIKE_M)
    expected = f"noise under {NOISE_RAD:g} rad and {1e3 * NOISE_M:g} mm, no spikes"
    if spikes.any():
        observed = f"{int(spikes.sum())} of {len(samples)} samples far off their neighbours"
        return Finding(Check.NOISE, expected, observed, Fault.SPIKES)
    pole_noise, cart_noise = _compute_noise(pole), _compute_noise(cart)
    observed = (
        f"{pole_noise:.2g} rad ({_describe_step(pole, 1, 'rad')}) and "
        f"{1e3 * cart_noise:.2g} mm ({_describe_step(cart, 1e3, 'mm')})"
    )
    noisy = pole_noise > NOISE_RAD or cart_noise > NOISE_M
    return Finding(Check.NOISE, expected, observed, Fault.NOISY if noisy else None)


def check_velocities(samples: Floats) -> Finding:
    """Return whether the velocities are 0 while the positions do not change."""
    state = measure_rest(samples)
    wrong = abs(state.pole_rad_s) > REST.pole_rad_s or abs(state.cart_m_s) > REST.cart_m_s
    observed = f"{state.pole_rad_s:.3g} rad/s and {state.cart_m_s:.3g} m/s"
    return Finding(
        Check.VELOCITIES,
        "0 rad/s and 0 m/s, as nothing moves",
        observed,
        Fault.VELOCITY_AT_REST if wrong else None,
    )


def _unwrap_positions(samples: Floats) -> tuple[Floats, Floats]:
    """Return angles, without jumps of whole turns, and cart positions."""
    angles = samples[:, POLE]
    return np.unwrap(angles) if has_wraps(angles) else angles, samples[:, CART]


def _find_spikes(values: Floats, least: float) -> NDArray[np.bool_]:
    away = np.abs(values - compute_running_median(values))
    return away > max(least, 8 * float(np.median(away)))


def _compute_noise(values: Floats) -> float:
    return float(np.std(np.diff(values)) / math.sqrt(2)) if len(values) > 1 else 0.0


def _describe_step(values: Floats, scale: float, unit: str) -> str:
    """Return the smallest change, which is the encoder's step, in words."""
    steps = np.diff(np.unique(values))
    steps = steps[steps > 1e-12]
    return f"steps of {scale * steps.min():.2g} {unit}" if len(steps) else "no step seen"
