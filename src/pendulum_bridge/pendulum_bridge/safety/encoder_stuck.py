"""Whether a position can truly stand exactly still while something must move it.

A reading that stays the same to the last bit is normal in itself: dry friction holds a cart, and a
hanging pole is at rest. An encoder counts as stuck only when no rig could stand still there whose
constants are wrong by CONSTANTS_SPREAD and whose dry friction is as large as is believed possible:

- The drive's impulse, through a lag, less what friction and the pole could have taken up, would
  have moved the cart by WAY_M. However wildly the pole swings, it takes up at most its own change
  of horizontal momentum.
- The cart's acceleration has changed by more than the pole's friction and a constant torque of any
  size could hide.
- The reported velocity is the same to the last bit too, and would have moved the joint by WAY_M
  or TURN_RAD: the same sample over and over. (A filtered velocity ends at a tiny number, not 0.)

This computer, or the rig's, may stand still. So a sample counts for at most a period, whatever the
clock says; a burst counts for the time it took; and after a gap of more than STANDSTILL_S nobody
knows when commands began to act: lag and way begin anew.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from pendulum_bridge.safety.encoder_reach import CONSTANTS_SPREAD, DRY_N, DRY_SHARE, NEAR_END_M
from pendulum_bridge.safety.reasons import Reason
from pendulum_bridge.safety.rig_state import RigState
from pendulum_twin.rig import Rig

LAG_S = 0.1  # largest lag of the drive, first order; a delay counts as lag
# a motion that would have shown itself by now: two steps of a coarse encoder
WAY_M, TURN_RAD = 0.002, 0.012
STANDSTILL_S = 0.03  # a gap between samples that a lag of LAG_S does not cover
WINDOW_S = 0.1  # time over which the cart's acceleration is measured
COSINE_ERROR = 0.15  # error of the cosine of the pole's angle, as the angle's zero may be wrong
REPEATED_SAMPLES = 10  # samples in a row with the same position and the same velocity, not 0


@dataclass(frozen=True)
class Holding:
    """Hold what can keep a rig where it is.

    force_n: N; force of the drive a unit of command, at least.
    dry_n: N; dry friction of the cart, at most.
    mass_kg: kg, at most.
    lever_kg_m: kg m; the pole's horizontal momentum a rad/s, at most; 0 without a pole.
    torque_n_m_s2: N m for each m/s^2; pull of the cart on the pole, at least; 0 without a pole.
    pole_n_m: N m; torque on the pole that may stay hidden.
    end_m: m, from the middle of the rail; beyond it the rail may end.
    period_s: s, from sample to sample.
    """

    force_n: float
    dry_n: float
    mass_kg: float
    lever_kg_m: float
    torque_n_m_s2: float
    pole_n_m: float
    end_m: float
    period_s: float


def compute_holding(rig: Rig, period_s: float, dry_n: float = DRY_N) -> Holding:
    """Return what can hold a rig with a cart.

    period_s: s, from sample to sample.
    dry_n: N; dry friction of the cart, at most.
    """
    least, most = 1 - CONSTANTS_SPREAD, 1 + CONSTANTS_SPREAD
    lever, inertia = (
        rig.total_mass_kg * (rig.com_distance_m or 0.0),
        rig.pole_inertia_kg_m2 or math.inf,
    )
    weight = lever * rig.gravity_m_s2
    seen_n_m = most * inertia * 2 * TURN_RAD / WINDOW_S**2 if lever else 0.0
    return Holding(
        force_n=least * (rig.force_per_pwm_n or 0.0),
        dry_n=dry_n,
        mass_kg=most * rig.total_mass_kg,
        lever_kg_m=most * lever,
        torque_n_m_s2=least * lever,
        pole_n_m=DRY_SHARE * weight + seen_n_m,
        end_m=math.inf if rig.rail_half_length_m is None else rig.rail_half_length_m - NEAR_END_M,
        period_s=period_s,
    )


@dataclass(frozen=True)
class Still:
    """Hold how long both positions have stood still, and what should have moved them.

    state: the last sample.
    drive: PWM fraction; the command through the lag.
    impulse_n_s: N s; impulse of the drive less friction, at least.
    rate_rad_s: rad/s; the pole's rate when the impulse began.
    way_m: m; way of the cart by that impulse, at least.
    slow_m_s: m/s; the cart's velocity through a filter of WINDOW_S.
    least_m_s2, most_m_s2: m/s^2; range of the cart's acceleration while the pole stood still.
    cart_repeats, pole_repeats: number of samples whose velocity was the same too.
    cart_repeated_m, pole_repeated_rad: m and rad; ways by these velocities.
    """

    state: RigState
    drive: float = 0.0
    impulse_n_s: float = 0.0
    rate_rad_s: float = 0.0
    way_m: float = 0.0
    slow_m_s: float | None = None
    least_m_s2: float = math.inf
    most_m_s2: float = -math.inf
    cart_repeats: int = 0
    pole_repeats: int = 0
    cart_repeated_m: float = 0.0
    pole_repeated_rad: float = 0.0


def follow_still(
    still: Still | None, sample: RigState, applied: float, passed_s: float, known: Holding
) -> Still:
    """Return the state after a sample.

    still: the state before; None at the first sample.
    applied: PWM fraction that was sent since the last sample.
    passed_s: s, since the last sample.
    known: what can hold the rig.
    """
    if still is None:
        return Still(sample)
    if passed_s > max(STANDSTILL_S, 1.5 * known.period_s):
        still = replace(still, drive=0.0, impulse_n_s=0.0, way_m=0.0)
    counted_s = min(passed_s, known.period_s)
    still = _follow_cart(still, sample, applied, counted_s, known)
    return replace(_follow_pole(still, sample, counted_s), state=sample)


def find_stuck(still: Still, known: Holding) -> Reason | None:
    """Return which encoder must be stuck, or None."""
    repeated = still.cart_repeats >= REPEATED_SAMPLES and still.cart_repeated_m > WAY_M
    if still.way_m > WAY_M or repeated:
        return Reason.CART_STUCK
    share = max(abs(math.cos(still.state.pole_rad)) - COSINE_ERROR, 0.0)
    change_m_s2 = max(still.most_m_s2 - still.least_m_s2, 0.0)
    moved = 0.5 * change_m_s2 * share * known.torque_n_m_s2 > known.pole_n_m
    repeated = still.pole_repeats >= REPEATED_SAMPLES and still.pole_repeated_rad > TURN_RAD
    return Reason.POLE_STUCK if moved or repeated else None


def _follow_cart(
    still: Still, sample: RigState, applied: float, passed_s: float, known: Holding
) -> Still:
    """Return the state with what the drive must have done to the cart."""
    drive = applied + (still.drive - applied) * math.exp(-passed_s / LAG_S)
    before = still.state
    if sample.cart_m != before.cart_m or abs(sample.cart_m) > known.end_m:
        return replace(
            still,
            drive=drive,
            impulse_n_s=0.0,
            way_m=0.0,
            cart_repeats=0,
            cart_repeated_m=0.0,
        )
    force_n = known.force_n * min(abs(drive), abs(still.drive)) - known.dry_n
    turned = drive * still.drive <= 0
    impulse = 0.0 if turned else max(still.impulse_n_s + passed_s * force_n, 0.0)
    rate = still.rate_rad_s if still.impulse_n_s else before.pole_rad_s
    taken = known.lever_kg_m * (abs(sample.pole_rad_s) + abs(rate))
    speed = max(impulse - taken, 0.0) / known.mass_kg
    repeated = sample.cart_m_s == before.cart_m_s != 0.0
    return replace(
        still,
        drive=drive,
        impulse_n_s=impulse,
        rate_rad_s=rate,
        way_m=still.way_m + passed_s * speed,
        cart_repeats=still.cart_repeats + 1 if repeated else 0,
        cart_repeated_m=still.cart_repeated_m + passed_s * abs(sample.cart_m_s)
        if repeated
        else 0.0,
    )


def _follow_pole(still: Still, sample: RigState, passed_s: float) -> Still:
    """Return the state with the cart's acceleration while the pole stood still."""
    slow = sample.cart_m_s if still.slow_m_s is None else still.slow_m_s
    slow = sample.cart_m_s + (slow - sample.cart_m_s) * math.exp(-passed_s / WINDOW_S)
    if sample.pole_rad != still.state.pole_rad:
        return replace(
            still,
            slow_m_s=slow,
            least_m_s2=math.inf,
            most_m_s2=-math.inf,
            pole_repeats=0,
            pole_repeated_rad=0.0,
        )
    acceleration = (sample.cart_m_s - slow) / WINDOW_S
    repeated = sample.pole_rad_s == still.state.pole_rad_s != 0.0
    return replace(
        still,
        slow_m_s=slow,
        least_m_s2=min(still.least_m_s2, acceleration),
        most_m_s2=max(still.most_m_s2, acceleration),
        pole_repeats=still.pole_repeats + 1 if repeated else 0,
        pole_repeated_rad=still.pole_repeated_rad + passed_s * abs(sample.pole_rad_s)
        if repeated
        else 0.0,
    )
