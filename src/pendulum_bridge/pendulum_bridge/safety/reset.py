"""Swing the pendulum down: cart to the middle, pole damped by the cart, rest verified.

The requested acceleration of the cart is a = -(p x + d v) - k cos(th) w. As the pole's energy
changes by S cos(th) a w (thesis, equation 23, multiplied by w), the last term takes energy out of
the pole at every angle; and hanging at rest in the middle is stable (poles at -1.7 +- 5.3i and
-1.9 +- 1.5i 1/s for table 1). A deadline ends a reset that does not come to rest.

The integral part follows the share of the command that the cart's motion does not show: a bias (a
tilted rail, a weaker motor), dry friction, which is compensated along the cart's motion, and a
dead
zone of the drive, which swallows commands in either direction. Measured on 60 random rigs with
0.5 N of dry friction: 4 came to rest within 20 s with an integral of the position, 56 with a fast
bias alone, all 60 with both. On 48 rigs with a dead zone of 0.02 to 0.06: 16 without following the
dead zone, 47 with.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from pendulum_bridge.safety.reasons import Reason
from pendulum_bridge.safety.rig_state import RigState
from pendulum_twin.errors import BadInputError
from pendulum_twin.rig import Rig

LONGEST_STEP_S = 0.05  # a longer gap between samples counts as this in the integral


@dataclass(frozen=True)
class Rest:
    """Define rest: hanging in the middle, all values within these bounds for consecutive samples.

    Infinite bounds of the pole leave it out.

    cart_m: m, from the middle.
    pole_rad: rad, from hanging.
    cart_m_s: m/s.
    pole_rad_s: rad/s; above what a rig that reports plain differences shows when one count of 4096
        changes in 10 ms, 0.153.
    samples: number of consecutive samples.
    standing_s: s; how long a pole may rest elsewhere before its encoder's zero counts as wrong.
    """

    cart_m: float = 0.02
    pole_rad: float = 0.03
    cart_m_s: float = 0.02
    pole_rad_s: float = 0.18
    samples: int = 20
    standing_s: float = 1.5


CART_REST = Rest(pole_rad=math.inf, pole_rad_s=math.inf)  # of a rig without a pole


@dataclass(frozen=True)
class SwingDown:
    """Hold the gains, which give a cart acceleration, and what turns that into a command.

    per_m_s2: PWM fraction for each m/s^2.
    friction: PWM fraction against viscous friction at 1 m/s.
    limit: PWM fraction, largest command.
    position_1_s2, velocity_1_s, damping_m_s: p, d and k of the module's law.
    dry_s, bias_s, dead_s: s; time constants of the estimates of dry friction, bias and dead zone.
    ahead_s: s; how far ahead the cart's direction is foreseen.
    slow_m_s: m/s; a slower cart counts as sticking.
    growth_1_s: PWM fraction a second; growth of the assumed dry friction while the cart sticks.
    narrow: PWM fraction; smaller commands get only their share of the dead zone.
    most_unseen: bound of bias and of dry friction, as a share of the limit.
    most_dead: bound of the dead zone, as a share of the limit.
    way, pole_way: the rig's signs, see `RailGuard`.
    deadline_s: s; a longer reset is given up.
    rest: the definition of rest.
    """

    per_m_s2: float
    friction: float
    limit: float
    position_1_s2: float = 4.0
    velocity_1_s: float = 3.0
    damping_m_s: float = 0.9
    dry_s: float = 0.15
    bias_s: float = 0.5
    dead_s: float = 0.2
    ahead_s: float = 0.05
    slow_m_s: float = 0.01
    growth_1_s: float = 0.2
    narrow: float = 0.03
    most_unseen: float = 0.4
    most_dead: float = 0.14
    way: int = 1
    pole_way: int = 1
    deadline_s: float = 20.0
    rest: Rest = Rest()


def make_swing_down(
    rig: Rig, limit: float, way: int = 1, pole_way: int = 1, deadline_s: float = 20.0
) -> SwingDown:
    """Return the swing-down for a rig; one without a pole is reset whatever its samples say of it.

    limit: PWM fraction, largest command.
    way, pole_way: the rig's signs, see `RailGuard`.
    deadline_s: s; a longer reset is given up.

    Raises BadInputError for a rig without a cart that can be driven.
    """
    if not rig.force_per_pwm_n or rig.cart_viscous_n_s_m is None:
        raise BadInputError(
            "reset: expected a rig with a cart and force_per_pwm_n above 0, found none"
        )
    if not 0 < deadline_s < math.inf:
        raise BadInputError(
            f"reset deadline: expected a number of seconds above 0, found {deadline_s!r}"
        )
    force = rig.force_per_pwm_n
    plan = SwingDown(
        per_m_s2=rig.total_mass_kg / force,
        friction=rig.cart_viscous_n_s_m / force,
        limit=limit,
        way=way,
        pole_way=pole_way,
        deadline_s=deadline_s,
    )
    return plan if rig.has_pole else replace(plan, damping_m_s=0.0, rest=CART_REST)


@dataclass(frozen=True)
class Reset:
    """Hold a reset that is under way.

    elapsed_s: s, since its beginning.
    at_rest: number of consecutive samples at rest.
    standing_s: s; how long the pole has been still without hanging.
    pwm: PWM fraction; the command until the next sample.
    cart_m_s: m/s; the cart's velocity in the last sample, None before the first.
    dry: PWM fraction against the motion (dry friction), along the rail's positive way.
    bias: PWM fraction that is always missing.
    dead: PWM fraction that is missing against the command (dead zone).
    """

    elapsed_s: float = 0.0
    at_rest: int = 0
    standing_s: float = 0.0
    pwm: float = 0.0
    cart_m_s: float | None = None
    dry: float = 0.0
    bias: float = 0.0
    dead: float = 0.0


def let_time_pass(reset: Reset, passed_s: float) -> Reset:
    """Return the reset passed_s (s) later; its command stays until the next `swing_on`."""
    return replace(reset, elapsed_s=reset.elapsed_s + max(passed_s, 0.0))


def swing_on(
    reset: Reset, state: RigState, applied: float, gap_s: float, plan: SwingDown
) -> Reset:
    """Return the reset after a new sample; while nothing moves, the command leaves the cart alone.

    applied: PWM fraction that was sent since the last sample.
    gap_s: s, since the last sample.
    """
    step = min(max(gap_s, 0.0), LONGEST_STEP_S)
    resting, standing = is_at_rest(state, plan.rest), is_zero_wrong(state, plan.rest)
    quiet = resting or standing
    reset = (
        replace(reset, cart_m_s=state.cart_m_s)
        if quiet
        else _observe(reset, state, applied * plan.way, step, plan)
    )
    wanted = _compute_wanted(state, plan)
    pushing = reset.bias if quiet else wanted + _compute_unseen(reset, state, wanted, plan)
    pwm = pushing + reset.dead * clip(pushing / plan.narrow, 1.0)
    return replace(
        reset,
        at_rest=reset.at_rest + 1 if resting else 0,
        standing_s=reset.standing_s + step if standing else 0.0,
        pwm=plan.way * clip(pwm, plan.limit),
    )


def find_end(reset: Reset, plan: SwingDown) -> Reason | None:
    """Return how a reset has ended by itself: done, wrong zero, or late; None while it goes on."""
    if reset.at_rest >= plan.rest.samples:
        return Reason.RESET_DONE
    if reset.standing_s > plan.rest.standing_s:
        return Reason.ZERO_WRONG
    return None if reset.elapsed_s <= plan.deadline_s else Reason.RESET_LATE


def find_obstacle(silence: Reason | None, stopped: bool) -> Reason | None:
    """Return why no reset may begin or go on, or None: first a latched stop, then a silent rig."""
    if stopped:
        return Reason.RESET_STOPPED
    return None if silence is None else Reason.RESET_SILENT


def is_at_rest(state: RigState, rest: Rest) -> bool:
    """Tell whether the pendulum hangs still in the middle of the rail in this sample."""
    return (
        is_still(state, rest)
        and abs(state.cart_m) <= rest.cart_m
        and abs(state.from_hanging_rad) <= rest.pole_rad
    )


def is_still(state: RigState, rest: Rest) -> bool:
    """Tell whether neither cart nor pole moves in this sample."""
    return abs(state.cart_m_s) <= rest.cart_m_s and abs(state.pole_rad_s) <= rest.pole_rad_s


def is_zero_wrong(state: RigState, rest: Rest) -> bool:
    """Tell whether the pole is still, but not hanging (whole turns aside), in this sample.

    A swinging pole is still for a moment where it turns; only a pole that stays so has a wrong
    zero.
    """
    return is_still(state, rest) and abs(state.from_hanging_rad) > rest.pole_rad


def clip(value: float, most: float) -> float:
    """Return the value limited to -most to most."""
    return min(max(value, -most), most)


def _compute_wanted(state: RigState, plan: SwingDown) -> float:
    """Return the command for the module's law, for a rig as its constants say."""
    centring = plan.position_1_s2 * state.cart_m + plan.velocity_1_s * state.cart_m_s
    wanted = (
        -centring - plan.pole_way * plan.damping_m_s * math.cos(state.pole_rad) * state.pole_rad_s
    )
    return wanted * plan.per_m_s2 + plan.friction * state.cart_m_s


def _compute_unseen(reset: Reset, state: RigState, wanted: float, plan: SwingDown) -> float:
    """Return the command against bias and dry friction; that acts against the coming motion."""
    going = state.cart_m_s + plan.ahead_s * wanted / plan.per_m_s2
    return reset.bias + reset.dry * clip(going / plan.slow_m_s, 1.0)


def _observe(
    reset: Reset, state: RigState, applied: float, step_s: float, plan: SwingDown
) -> Reset:
    """Return the reset with the estimates updated from the cart's motion since the last sample.

    Missing force against the motion is dry friction. A cart that sticks shows only that there is
    more
    of it: the assumed friction grows until the cart moves.
    """
    if reset.cart_m_s is None or step_s == 0.0:
        return replace(reset, cart_m_s=state.cart_m_s)
    most = plan.most_unseen * plan.limit
    if abs(state.cart_m_s) <= plan.slow_m_s:
        return replace(
            reset, cart_m_s=state.cart_m_s, dry=min(reset.dry + plan.growth_1_s * step_s, most)
        )
    acceleration = (state.cart_m_s - reset.cart_m_s) / step_s
    lost = applied - acceleration * plan.per_m_s2 - plan.friction * state.cart_m_s
    way = math.copysign(1.0, state.cart_m_s)
    error = lost - reset.bias - way * reset.dry - clip(applied, reset.dead)
    dry = reset.dry + way * error * min(step_s / plan.dry_s, 1.0)
    bias = reset.bias + error * min(step_s / plan.bias_s, 1.0)
    dead = reset.dead
    if reset.elapsed_s > 0.5 * plan.deadline_s:
        # a delay looks like a dead zone, and following it feeds a swing: so not in the second half
        dead = 0.0
    elif abs(applied) > dead:  # a smaller command is swallowed whole, and shows no width
        dead += math.copysign(1.0, applied) * error * min(step_s / plan.dead_s, 1.0)
    return replace(
        reset,
        cart_m_s=state.cart_m_s,
        dry=min(max(dry, 0.0), most),
        bias=clip(bias, most),
        dead=min(max(dead, 0.0), plan.most_dead * plan.limit),
    )
