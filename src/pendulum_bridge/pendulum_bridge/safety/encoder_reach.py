"""Whether a position can have been reached since the last good sample, by anything that the rig can do.

The bound is wide on purpose. Constants may be wrong by a share, more time may have passed than
anybody knows (a lost packet), or none (a burst); near the end of the rail, where a cart rebounds,
velocities may have turned round at once. What
goes beyond it all is no motion: counts lost in bulk, a bad cable, a pole's angle that lost whole
turns.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from pendulum_bridge.safety.rig_state import RigState
from pendulum_twin.errors import BadInputError
from pendulum_twin.rig import Rig

CONSTANTS_SPREAD = 0.3  # share by which every constant of the rig may be wrong
DRY_N, DRY_SHARE = (
    2.0,
    0.1,
)  # dry friction believed possible: of the cart; of the pole, as a share of its weight's torque
STEP_M, STEP_RAD = 0.002, 0.02  # of the coarsest encoders
NEAR_END_M = 0.1  # from the end of the rail: the cart may hit it, or be held by it
Span = tuple[float, float]  # from the lowest, at most 0, to the highest, at least 0


@dataclass(frozen=True)
class Reach:
    """Hold how fast a rig can accelerate: at rest, and more by the square of the pole's rate.

    cart_m_s2, pole_rad_s2: largest accelerations at rest (infinite for a pole that is not known).
    cart_m, pole_1: more for each (rad/s)^2 of the pole's rate. cart_1_s, pole_1_m: more for each
    m/s of the cart's speed. end_m: from the middle to where the cart may hit the end. period_s:
    from sample to sample.
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
    """Return the reach of a rig whose commands are at most limit (PWM fraction); raise BadInputError without a cart."""
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
    """Hold the last good sample, how long ago it was, and between what its velocities lie (m/s, rad/s).

    good: how many good ones there have been in a row.
    """

    state: RigState
    age_s: float
    cart_m_s: Span
    pole_rad_s: Span
    good: int = 1


def make_anchor(state: RigState, before: Anchor | None, reach: Reach) -> Anchor:
    """Return the anchor at a good sample: velocities lie between what is reported, what is seen, and 0."""
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
    """Return the anchor at a sample that cannot be: its velocities are as wrong as its positions, so the anchor's stay."""
    here = replace(anchor.state, cart_m=state.cart_m, pole_rad=state.pole_rad)
    return replace(anchor, state=here, age_s=0.0)


def age_anchor(anchor: Anchor, passed_s: float) -> Anchor:
    """Return the anchor as seen passed_s later."""
    return replace(anchor, age_s=anchor.age_s + max(passed_s, 0.0))


def compute_share_of_reach(state: RigState, anchor: Anchor, slack_s: float, reach: Reach) -> float:
    """Return how far the positions are from the anchor's, as a share of what can have been reached; over 1, a jump.

    slack_s: how much longer ago the anchor may have been than is known.
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
    """Tell whether the positions are nearer to where they would be now coming from there than coming from here."""

    def off(anchor: Anchor) -> float:
        cart = state.cart_m - anchor.state.cart_m - anchor.state.cart_m_s * anchor.age_s
        pole = state.pole_rad - anchor.state.pole_rad - anchor.state.pole_rad_s * anchor.age_s
        return _compute_share(cart, pole, here, here.age_s, reach)

    return off(there) < off(here)


def _compute_share(
    cart_m: float, pole_rad: float, anchor: Anchor, seconds: float, reach: Reach
) -> float:
    """Return two ways as shares of what cart and pole can go in so many seconds from the anchor; the larger one."""
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
    """Return the largest speed the way that a position has gone."""
    return span[1] if way > 0 else -span[0]


def _span_velocities(both_ways: bool, *velocities: float) -> Span:
    low, high = min(0.0, *velocities), max(0.0, *velocities)
    return (min(low, -high), max(high, -low)) if both_ways else (low, high)
