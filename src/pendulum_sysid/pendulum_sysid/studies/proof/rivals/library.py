"""The catalogue's terms along a smoothed motion, as columns for a sparse regression.

Two equations: the force that the cart's motion lacks, and the torque that the pole's does, both
linear in these columns. A joint's own acceleration is what is to be explained, and no column.
Every column belongs to one effect, or to none for the base model's own terms. Places, periods and
times enter as a few typical values, each a column of its own.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import cont2discrete, lfilter

from pendulum_sysid.cleaning.smoothing import differentiate, smooth
from pendulum_sysid.finding.localisation.balance import Motion
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.studies.proof.rivals.ground import Ground
from pendulum_twin.arrays import Floats, Mask
from pendulum_twin.inverse_dynamics import compute_missing_force
from pendulum_twin.parameter_vector import (
    CART_VISCOUS,
    COUPLING,
    FORCE_PER_PWM,
    GRAVITY,
    INERTIA,
    MASS,
    MOMENT,
    POLE_VISCOUS,
    SLOTS,
)
from pendulum_twin.sensors import undo_sensors
from pendulum_twin.signals import Signals

DELAYS_S = (0.01, 0.03)
LAGS_S = (0.02, 0.08)
RAMPS_S = (0.1, 0.3)  # to the largest command
BELTS_S = (0.1, 0.2)
LIMITS = (0.5, 0.75)  # of the largest command
BENDS = (1.0, 1.5)  # of the largest command
COARSE = (0.1, 0.2)  # of the largest command
WARMING_S = (10.0,)
INSTANTS = (0.25, 0.5, 0.75)  # of the recording
STRIBECK_SPEEDS = (0.1, 0.4)  # of the root mean square speed
PLACES = (-0.6, -0.2, 0.2, 0.6)  # of the travel
PERIODS = (0.1, 0.2, 0.4, 0.8)  # of the travel


@dataclass(frozen=True)
class Equation:
    """Hold one regression.

    effects: (terms,) the effect to which each column belongs; "" for the base model's terms.
    columns: (n, terms).
    target: (n,) force or torque that is to be explained, N or N m.
    usable: (n,) which samples count.
    """

    effects: tuple[str, ...]
    columns: Floats
    target: Floats
    usable: Mask


def build_equations(ground: Ground) -> tuple[Equation, ...]:
    """Return the equations of the joints that the recording holds, over all its samples.

    The measured accelerations are smoothed, which rounds every kink of the command and of dry
    friction; so everything that stands beside them goes through the same smoothing.
    """
    case, theta = ground.case, ground.base.theta
    signals, state = case.signals, case.state
    _, usable = compute_missing_force(signals, state.states, state.accelerations, theta)
    along = _undo_sensors_along(case, theta)
    half = find_half_length(signals)
    base_force = theta[FORCE_PER_PWM] * along.u - theta[CART_VISCOUS] * along.v
    base_torque = theta[MOMENT] * theta[GRAVITY] * np.sin(along.th) - theta[POLE_VISCOUS] * along.w
    coupled = theta[COUPLING] * np.cos(along.th)
    result = []
    if signals.cart is not None:
        whirl = theta[COUPLING] * np.sin(along.th) * along.w**2
        target = (
            theta[MASS] * along.a
            - coupled * along.b
            - smooth_like_positions(base_force - whirl, signals, half)
        )
        result.append(
            _make_equation(list_cart_terms(along, signals.period_s), target, usable, signals, half)
        )
    if signals.pole is not None:
        target = (
            theta[INERTIA] * along.b
            - coupled * along.a
            - smooth_like_positions(base_torque, signals, half)
        )
        result.append(_make_equation(list_pole_terms(along), target, usable, signals, half))
    return tuple(result)


def _undo_sensors_along(case: Case, theta: Floats) -> Motion:
    """Return smoothed states, accelerations and command of the rig, its sensors undone."""
    signals, state = case.signals, case.state
    x, th, v, w = undo_sensors(state.states[None], theta[None], signals.clock_s)[0].T
    turned = np.concatenate([state.states[:, :2], state.accelerations], axis=1)
    a, b = undo_sensors(turned[None], theta[None], signals.clock_s)[0][:, 2:].T  # for their signs
    command = -signals.command if theta[SLOTS["input_sign_inverted"]][0] else signals.command
    # the mean about a sample: a command is held before it, the next after it
    u = 0.5 * (command + np.append(command[:1], command[:-1]))
    t = np.arange(len(signals), dtype=np.float64) * signals.period_s
    return Motion(x, th, v, w, a, b, u.astype(np.float64), t)


def find_half_length(signals: Signals) -> int:
    """Return the length over which accelerations are smoothed; see `smooth_state.smooth_state`."""
    joints = ((signals.cart, signals.cart_valid), (signals.pole, signals.pole_valid))
    halves = [
        smooth(p, v, signals.stretches, signals.period_s).half_length
        for p, v in joints
        if p is not None
    ]
    return max(2 * min(halves), max(halves))


def smooth_like_positions(values: Floats, signals: Signals, half: int) -> Floats:
    """Return an acceleration (n,) as it comes out of smoothing the positions that it leads to."""
    positions = np.cumsum(np.append(0.0, np.cumsum(values)[:-1])) * signals.period_s**2
    return differentiate(positions, signals.stretches, signals.period_s, half, 2)


def _make_equation(
    terms: list[tuple[str, Floats]], target: Floats, usable: Mask, signals: Signals, half: int
) -> Equation:
    columns = np.stack([smooth_like_positions(term, signals, half) for _, term in terms], axis=1)
    return Equation(tuple(name for name, _ in terms), columns, target, usable)


def list_cart_terms(along: Motion, period_s: float) -> list[tuple[str, Floats]]:
    """Return (effect, column) of what may push the cart."""
    x, v, u = along.x, along.v, along.u
    sign, speed, travel, most = (
        np.sign(v),
        np.abs(v),
        np.ptp(x) / 2 or 1.0,
        np.max(np.abs(u)) or 1.0,
    )
    typical = np.sqrt(np.mean(v**2)) or 1.0
    middle = np.mean([x.min(), x.max()])
    terms = [
        ("", u),
        ("", v),
        ("", np.cos(along.th) * along.b - np.sin(along.th) * along.w**2),
        *(("input_delay", _delay_command(along, s) - u) for s in DELAYS_S),
        *(("motor_lag", _lag_command(along, period_s, s) - u) for s in LAGS_S),
        *(("drive_slew_limit", _limit_slew(along, period_s, s / most) - u) for s in RAMPS_S),
        *(("stretching_belt", _stretch_belt(along, period_s, s) - u) for s in BELTS_S),
        ("input_dead_zone", np.sign(u)),
        *(
            ("input_saturation", np.sign(u) * np.maximum(np.abs(u) - f * most, 0.0))
            for f in LIMITS
        ),
        *(("soft_saturation", f * most * np.tanh(u / (f * most)) - u) for f in BENDS),
        *(("coarse_command", f * most * np.round(u / (f * most)) - u) for f in COARSE),
        ("gain_asymmetry", np.abs(u)),
        ("gain_drift", u * along.t),
        ("cart_coulomb_friction", sign),
        *(
            ("cart_stribeck_friction", sign * np.exp(-((speed / (f * typical)) ** 2)))
            for f in STRIBECK_SPEEDS
        ),
        *(("friction_warming", c * np.exp(-along.t / s)) for c in (sign, v) for s in WARMING_S),
        ("cart_quadratic_drag", v * speed),
        *(("load_put_on", along.a * (along.t >= f * along.t[-1])) for f in INSTANTS),
        ("rail_tilt", np.ones_like(x)),
        ("rail_spring", x),
        *(
            (name, column * np.exp(-(((x - middle) / travel - f) ** 2) / 0.3**2))
            for name, column in (("rail_friction_patch", sign), ("rail_drag_patch", v))
            for f in PLACES
        ),
    ]
    for f in PERIODS:
        angle = 2 * np.pi * x / (f * travel)
        for wave in (np.sin(angle), np.cos(angle)):
            terms += [("cogging", wave), ("force_ripple", u * wave)]
    return terms


def list_pole_terms(along: Motion) -> list[tuple[str, Floats]]:
    """Return (effect, column) of what may turn the pole."""
    th, w = along.th, along.w
    hanging = th - np.pi
    return [
        ("", np.sin(th)),
        ("", np.cos(th) * along.a),
        ("", w),
        ("pole_coulomb_friction", np.sign(w)),
        ("pole_quadratic_drag", w * np.abs(w)),
        ("pole_spring", hanging),
        ("angle_offset", np.cos(th)),
        ("eccentric_encoder", np.sin(2.0 * th)),
        ("eccentric_encoder", np.cos(2.0 * th)),
        ("angle_scale", hanging * np.cos(th)),
    ]


def _delay_command(along: Motion, seconds: float) -> Floats:
    return np.interp(along.t - seconds, along.t, along.u)


def _stretch_belt(along: Motion, period_s: float, seconds: float) -> Floats:
    """Return the command as a belt with a tenth of the critical damping passes it on, (n,)."""
    slow = seconds / (2.0 * np.pi)
    passes, holds = [0.2 * slow, 1.0], [slow**2, 0.2 * slow, 1.0]
    numerator, denominator, _ = cont2discrete((passes, holds), period_s)
    return np.asarray(lfilter(numerator[0], denominator, along.u))


def _lag_command(along: Motion, period_s: float, seconds: float) -> Floats:
    gone = 1.0 - np.exp(-period_s / seconds)
    return np.asarray(lfilter([gone], [1.0, gone - 1.0], along.u))


def _limit_slew(along: Motion, period_s: float, seconds: float) -> Floats:
    """Return the command as a drive passes it on that takes so long to a command of 1, (n,)."""
    limited, reach = np.empty_like(along.u), period_s / seconds
    passed = float(along.u[0])
    for k, u in enumerate(along.u.tolist()):
        passed += min(max(u - passed, -reach), reach)
        limited[k] = passed
    return limited
