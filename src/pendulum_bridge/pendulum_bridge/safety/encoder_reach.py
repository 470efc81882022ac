"""Whether the rig can have moved from the last good sample to a position.

The bound is wide on purpose. Constants may be wrong by a share; more time may have passed than is
known (a lost packet), or none (a burst); near the end of the rail, where a cart rebounds,
velocities may have turned at once. A position beyond the bound is no motion: counts lost in bulk,
a bad cable, a pole angle that lost whole turns.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from pendulum_bridge.safety.rig_state import RigState
from pendulum_twin.errors import BadInputError
from pendulum_twin.rig import Rig

CONSTANTS_SPREAD = 0.3  # share by which every constant of the rig may be wrong
DRY_N = 2.0  # largest dry friction of the cart that is believed possible
DRY_SHARE = 0.1  # the same of the pole, as a share of its weight's torque
STEP_M, STEP_RAD = 0.002, 0.02  # steps of the coarsest encoders
NEAR_END_M = 0.1  # nearer to the end of the rail the cart may hit it, or be held by it
Span = tuple[float, float]  # lowest (at most 0) and highest (at least 0)


@dataclass(frozen=True)
class Reach:
    """Hold how fast a rig can accelerate: at rest, and the increase with the speeds.

    cart_m_s2: m/s^2; largest acceleration of the cart at rest.
    cart_m: m/s^2 for each (rad/s)^2 of the pole's rate.
    cart_1_s: m/s^2 for each m/s of the cart's speed.
    pole_rad_s2: rad/s^2; of the pole at rest, infinite when the pole is unknown.
    pole_1: rad/s^2 for each (rad/s)^2 of the pole's rate.
    pole_1_m: rad/s^2 for each m/s of the cart's speed.
    end_m: m, from the middle of the rail; beyond it the cart may hit the end.
    period_s: s, from sample to sample.
    """

    cart_m_s2: float
    cart_m: float
    cart_1_s: float
    pole_rad_s2: float
    pole_1: float
    pole_1_m: float
    end_m: float
    period_s: float


def compute_reach(rig: Rig, limit: float, period_s: float, dry_n: float = DRY_N) -> Reach:
    """Return the reach of a rig whose commands are at most limit (PWM fraction).

    Raises BadInputError for a rig without a cart.
    """
    if rig.force_per_pwm_n is None or rig.cart_viscous_n_s_m is None:
        raise BadInputError("encoder check: expected a rig with a cart, found none")
    end_m = math.inf if rig.rail_half_length_m is None else rig.rail_half_length_m - NEAR_END_M
    more = (1 + CONSTANTS_SPREAD) / (1 - CONSTANTS_SPREAD)
    mass, drive, friction = (
        rig.total_mass_kg,
        rig.force_per_pwm_n * limit + dry_n,
        rig.cart_viscous_n_s_m,
    )
    if rig.com_distance_m is None or rig.pole_inertia_kg_m2 is None:
        return Reach(
            more * drive / mass, 0.0, more * friction / mass, math.inf, 0.0, 0.0, end_m, period_s
        )
    lever, inertia = mass * rig.com_distance_m, rig.pole_inertia_kg_m2
    weight = lever * rig.gravity_m_s2 * (1 + DRY_SHARE)
    # both equations of motion, solved for the accelerations at the worst angle
    share = more / max(mass * inertia - lever**2, 0.1 * mass * inertia)
    return Reach(
        cart_m_s2=share * (inertia * drive + lever * weight),
        cart_m=share * inertia * lever,
        cart_1_s=share * inertia * friction,
        pole_rad_s2=share * (mass * weight + lever * drive),
        pole_1=share * lever**2,
        pole_1_m=share * lever * friction,
        end_m=end_m,
        period_s=period_s,
    )


@dataclass(frozen=True)
class Anchor:
    """Hold the last good sample and the range of its velocities.

    state: the sample.
    age_s: s; how long ago it was taken.
    cart_m_s: m/s; range of the cart's velocity, lowest and highest.
    pole_rad_s: rad/s; range of the pole's rate.
    good: number of good samples in a row up to this one.
    """

    state: RigState
    age_s: float
    cart_m_s: Span
    pole_rad_s: Span
    good: int = 1


def make_anchor(state: RigState, before: Anchor | None, reach: Reach) -> Anchor:
    """Return the anchor at a good sample.

    Its velocities range over the reported velocity, the observed velocity, and 0.

    before: the anchor at the good sample before; None for none.
    """
    cart = pole = 0.0
    if before is not None:
        passed_s = max(before.age_s, 0.25 * reach.period_s)
        cart = (state.cart_m - before.state.cart_m) / passed_s
        pole = (state.pole_rad - before.state.pole_rad) / passed_s
    good = 1 if before is None else before.good + 1
    hit = abs(state.cart_m) > reach.end_m
    return Anchor(
        state,
        0.0,
        _span_velocities(hit, cart, state.cart_m_s),
        _span_velocities(hit, pole, state.pole_rad_s),
        good,
    )


def move_anchor(state: RigState, anchor: Anchor) -> Anchor:
    """Return the anchor at the positions of an impossible sample, with its own velocities.

    The sample's velocities are as wrong as its positions.
    """
    here = replace(anchor.state, cart_m=state.cart_m, pole_rad=state.pole_rad)
    return replace(anchor, state=here, age_s=0.0)


def age_anchor(anchor: Anchor, passed_s: float) -> Anchor:
    """Return the anchor passed_s (s) later."""
    return replace(anchor, age_s=anchor.age_s + max(passed_s, 0.0))


def compute_share_of_reach(state: RigState, anchor: Anchor, slack_s: float, reach: Reach) -> float:
    """Return the way from the anchor as a share of what can have been reached; over 1 is a jump.

    slack_s: s; how much longer ago than known the anchor may have been.
    """
    here = anchor.state
    return _compute_share(
        state.cart_m - here.cart_m,
        state.pole_rad - here.pole_rad,
        anchor,
        anchor.age_s + slack_s,
        reach,
    )


def is_nearer(state: RigState, there: Anchor, here: Anchor, reach: Reach) -> bool:
    """Tell whether positions fit a motion from `there` better than a motion from `here`."""

    def off(anchor: Anchor) -> float:
        cart = state.cart_m - anchor.state.cart_m - anchor.state.cart_m_s * anchor.age_s
        pole = state.pole_rad - anchor.state.pole_rad - anchor.state.pole_rad_s * anchor.age_s
        return _compute_share(cart, pole, here, here.age_s, reach)

    return off(there) < off(here)


def _compute_share(
    cart_m: float, pole_rad: float, anchor: Anchor, seconds: float, reach: Reach
) -> float:
    """Return the larger of both ways, each as a share of what can be gone in that time.

    cart_m, pole_rad: m and rad; the ways of cart and pole.
    """
    cart_m_s, rate = max(map(abs, anchor.cart_m_s)), max(map(abs, anchor.pole_rad_s))
    cart_m_s2 = reach.cart_m_s2 + reach.cart_1_s * cart_m_s + reach.cart_m * rate**2
    pole_rad_s2 = reach.pole_rad_s2 + reach.pole_1_m * cart_m_s + reach.pole_1 * rate**2
    most_m = STEP_M + seconds * (
        _find_speed_towards(cart_m, anchor.cart_m_s) + 0.5 * cart_m_s2 * seconds
    )
    most_rad = STEP_RAD + seconds * (
        _find_speed_towards(pole_rad, anchor.pole_rad_s) + 0.5 * pole_rad_s2 * seconds
    )
    return max(abs(cart_m) / most_m, abs(pole_rad) / most_rad)


def _find_speed_towards(way: float, span: Span) -> float:
    """Return the largest speed in the direction of a way."""
    return span[1] if way > 0 else -span[0]


def _span_velocities(both_ways: bool, *velocities: float) -> Span:
    low, high = min(0.0, *velocities), max(0.0, *velocities)
    return (min(low, -high), max(high, -low)) if both_ways else (low, high)
