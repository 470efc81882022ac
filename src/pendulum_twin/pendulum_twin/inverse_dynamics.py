"""Compute the force and torque that a recorded motion needs beyond those of a twin."""

from __future__ import annotations

import numpy as np

from pendulum_twin import kernel
from pendulum_twin.arrays import Floats, Ints, Mask
from pendulum_twin.free_runs import run_drive
from pendulum_twin.lagging_angle import compute_lags, lead_angle
from pendulum_twin.late_angle import compute_delays, drop_delays, look_ahead
from pendulum_twin.law_curves import fill_measured_laws, sum_measured_laws
from pendulum_twin.motion import (
    add_cart_forces,
    add_pole_torques,
    bend_drive,
    compute_cart_level,
    compute_pole_level,
    sum_costly_laws,
    sum_held_effects,
    sum_loads,
)
from pendulum_twin.parameter_vector import (
    CART_VISCOUS,
    COUPLING,
    FORCE_PER_PWM,
    GRAVITY,
    INERTIA,
    MASS,
    MOMENT,
    POLE_VISCOUS,
)
from pendulum_twin.path_memory import follow_recorded_path
from pendulum_twin.sensors import compute_paces, follow_paces, undo_sensors
from pendulum_twin.signals import Signals

# Of the root mean square speed: below it the cart counts as standing, where dry friction takes any
# value.
STANDING_SPEED_SHARE = 0.03
# s; half of the way along the motion over which the bend of a sensor's error is taken
PROBED_S = 1e-3
EVERY = slice(None)  # sample


@kernel.compile_cached
def _bend_drives(x, v, t, p, out):  # type: ignore[no-untyped-def]
    """Turn out (n, 2) into what the effects of the drive make of it, in place.

    Its columns: forces of the drive, N; forces of the friction that the drive frees, N, once 0.
    """
    for n in range(len(x)):
        gain = sum_held_effects(x[n], 0.0, 0.0, t[n], p, 0, 1)[0]
        out[n, 0], viscous = bend_drive(out[n, 0] * gain, v[n], p, 0, 1)
        out[n, 1] = -viscous * v[n]


@kernel.compile_cached
def _fill_masses(t, h, p, out):  # type: ignore[no-untyped-def]
    for n in range(len(t)):
        out[n] = p[MASS] + sum_loads(t[n], h, p, 0, 1)


@kernel.compile_cached
def _fill_laws(x, th, v, w, t, masses, p, out):  # type: ignore[no-untyped-def]
    for n in range(len(x)):
        p[MASS] = masses[n]
        push, turn, cart_dry, pole_dry = sum_measured_laws(p, x[n], v[n], th[n], w[n], t[n], 0.0)[
            1:
        ]
        _, force, dry, drag = sum_held_effects(x[n], th[n], w[n], t[n], p, 0, 1)
        evenly = push + force - drag * v[n], turn, cart_dry + dry, pole_dry
        applied = evenly + sum_costly_laws(x[n], th[n], v[n], w[n], p, 0, 1)
        cart_way, pole_way = np.sign(v[n]), np.sign(w[n])
        out[n, 0] = applied[0] + add_cart_forces(x[n], v[n], th[n], w[n], applied, p, 0, 1)
        level = compute_cart_level(abs(v[n]), x[n], cart_way, applied, p, 0, 1)
        out[n, 0] -= cart_way * level
        out[n, 1] = applied[1] + add_pole_torques(x[n], v[n], th[n], w[n], applied, p, 0, 1)
        level = compute_pole_level(abs(w[n]), th[n], pole_way, applied, p, 0, 1)
        out[n, 1] -= pole_way * level


def evaluate_laws(
    signals: Signals, states: Floats, theta: Floats, at: Ints | slice = EVERY
) -> Floats:
    """Return the force (N) and torque (N m) of effects and laws of cart and pole, shape (k, 2).

    states: (n, 4) measured; theta: (SIZE,).
    at: (k,) samples that are asked about; all without it.
    """
    true = undo_sensors(states[None], theta[None], signals.clock_s)[0]
    columns = [np.ascontiguousarray(true[at, k]) for k in range(4)]
    out = np.empty((len(columns[0]), 2))
    masses = compute_masses(signals, theta)[at]
    times_s = signals.clock_s[at] * float(compute_paces(theta))
    _fill_laws(*columns, times_s, masses, theta.copy(), out)
    nowhere = np.zeros(0, dtype=np.int64)
    out += follow_recorded_path(signals, true[:, :2], theta, nowhere)[1][at]
    return out


def compute_masses(signals: Signals, theta: Floats) -> Floats:
    """Return the mass of all that moves along the rail around every sample, kg, (n,)."""
    masses, pace = np.empty(len(signals)), float(compute_paces(theta))
    _fill_masses(signals.clock_s * pace, signals.period_s * pace, theta, masses)
    return masses


def compute_missing_force(
    signals: Signals, states: Floats, accelerations: Floats, theta: Floats
) -> tuple[Floats, Mask]:
    """Return the force (N) and torque (N m) that the twin lacks, (n, 2), and where they count.

    states: (n, 4) measured and smoothed.
    accelerations: (n, 2) of cart (m/s^2) and pole (rad/s^2).
    theta: (SIZE,).

    A sample does not count where it is not valid or where the cart hardly moves.
    """
    delay_s, lag_s = (float(compute(theta[None])[0]) for compute in (compute_delays, compute_lags))
    if lag_s > 0.0:
        states, accelerations = lead_angle(signals, states, accelerations, lag_s)
    if delay_s > 0.0:
        states, accelerations = look_ahead(signals, states, accelerations, delay_s)
    theta = drop_delays(theta[None])[0]
    true = undo_sensors(states[None], theta[None], signals.clock_s)[0]
    paces = follow_paces(theta[None], signals.clock_s[None])[0]
    a, b = _undo_accelerations(signals, states, accelerations, theta).T / paces
    _, th, v, w = true.T
    coupling = theta[COUPLING]
    sine, cosine = np.sin(th), np.cos(th)
    laws = evaluate_laws(signals, states, theta)
    force = (
        compute_masses(signals, theta) * a
        - coupling * (cosine * b - sine * w**2)
        + theta[CART_VISCOUS] * v
        - laws[:, 0]
    )
    gain = np.empty((len(true), 5))
    clock_s = signals.clock_s * float(compute_paces(theta))
    fill_measured_laws(np.ascontiguousarray(true), clock_s, theta, gain)
    drive = np.zeros((len(true), 2))
    drive[:, 0] = theta[FORCE_PER_PWM] * _average_drive(signals, theta)
    _bend_drives(true[:, 0].copy(), v.copy(), clock_s, theta, drive)
    force -= drive[:, 0] * gain[:, 0] + drive[:, 1]
    torque = theta[INERTIA] * b - coupling * cosine * a - theta[MOMENT] * theta[GRAVITY] * sine
    torque += theta[POLE_VISCOUS] * w - laws[:, 1]
    usable = np.ones(len(signals), dtype=bool)
    if signals.cart is not None:
        usable &= signals.cart_valid & (np.abs(v) > STANDING_SPEED_SHARE * np.sqrt(np.mean(v**2)))
    if signals.pole is not None:
        usable &= signals.pole_valid
    return np.stack([force, torque], axis=1), usable


def _undo_accelerations(
    signals: Signals, states: Floats, accelerations: Floats, theta: Floats
) -> Floats:
    """Return the derivatives (n, 2) of the true velocities by the stamps, m/s^2 and rad/s^2.

    Where a sensor's error bends with the position, or the clock's pace changes, velocities alone
    are seen as an acceleration.
    """

    def undo_rates(since_s: float, rates: Floats) -> Floats:
        moved = states[:, :2] + since_s * states[:, 2:]
        turned = np.concatenate([moved, rates], axis=1)
        return undo_sensors(turned[None], theta[None], signals.clock_s[None] + since_s)[0][:, 2:]

    after, before = (undo_rates(s, states[:, 2:]) for s in (PROBED_S, -PROBED_S))
    return undo_rates(0.0, accelerations) + (after - before) / (2.0 * PROBED_S)


def _average_drive(signals: Signals, theta: Floats) -> Floats:
    """Return the drive around each sample: the mean over the periods before and after it."""
    rows, _ = run_drive(signals, theta[None])
    after = rows[0].reshape(len(signals), -1).mean(axis=1)
    before = np.concatenate([after[:1], after[:-1]])
    return 0.5 * (before + after)
