"""Keep the cart on the rail: brake while there is still room to.

The guard watches the centre of mass of cart and pole, q = x - l sin(th). Only the drive and the
cart's friction move it (m q'' = force - fc v: the sum of the equations of motion, thesis,
equations 18-23), whatever the pole does, and the cart is never further from it than l. So a
spinning pole needs no allowance of its own.

For a command u the guard foresees: since the sample the strongest possible push has acted; the
last command acts on for the delay; u acts until the next decision; then the brake is full. The
largest u that stops before the end is the largest that is sent. Pushes towards the end are assumed
stronger, brakes and friction weaker than the rig's constants say.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from pendulum_bridge.safety.reasons import Reason
from pendulum_bridge.safety.rig_state import RigState
from pendulum_twin.errors import BadInputError
from pendulum_twin.rig import Rig

HALVINGS = 12  # bisections of the range of commands: exact to 1/4096 of it
AWAY_M_S = 0.05  # a slower cart counts as at rest
BACK_M_S = 0.2  # the cart is sent back no faster


@dataclass(frozen=True)
class RailGuard:
    """Hold what the guard knows of the rig, and how far it trusts that.

    end_m: m, from the middle; where the cart has to stop.
    reach_m: m; l, from the cart to the centre of mass; wrong by at most a share of spread.
    spread: share by which every constant of the rig may be wrong.
    push_m_s2: m/s^2 a unit of command, at most.
    brake_m_s2: m/s^2 a unit of command, at least.
    friction_1_s: 1/s; viscous friction over mass, at least.
    limit: PWM fraction, largest command.
    delay_s: s, from a command to its force.
    hold_s: s; how long a command acts, at most, before the next decision.
    back: share of the limit that sends a resting cart back.
    patience_s: s; how long a cart may be pushed back without effect.
    way: +1, or -1 on a rig where a positive command moves the measured cart the negative way.
    pole_way: +1, or -1 where cart or pole alone is measured mirrored; 0 where neither is known,
        and both have to be safe.
    """

    end_m: float
    reach_m: float
    spread: float
    push_m_s2: float
    brake_m_s2: float
    friction_1_s: float
    limit: float
    delay_s: float
    hold_s: float
    back: float
    patience_s: float
    way: int
    pole_way: int


def make_rail_guard(
    rig: Rig,
    limit: float,
    margin_m: float = 0.05,
    spread: float = 0.3,
    delay_s: float = 0.02,
    hold_s: float = 0.03,
    back: float = 0.3,
    patience_s: float = 1.0,
    way: int = 1,
    pole_way: int = 1,
) -> RailGuard:
    """Return the guard of a rig whose every constant may be wrong by a share of spread.

    margin_m: m; how far before the end of the rail the cart has to stop.
    The other arguments: see `RailGuard`.

    Raises BadInputError for a rig without cart or rail length, and when its rail is too
    short for margin and pole.
    """
    if (
        rig.force_per_pwm_n is None
        or rig.cart_viscous_n_s_m is None
        or rig.rail_half_length_m is None
    ):
        raise BadInputError(
            "rail guard: expected a rig with a cart and rail_half_length_m, found one of them "
            "missing"
        )
    if not 0 <= spread < 1 or not margin_m >= 0 or {abs(way), abs(pole_way)} != {1}:
        raise BadInputError(
            "rail guard: expected a spread from 0 to below 1, a margin of at least 0 m and ways "
            "of 1 or -1, "
            f"found {spread:g}, {margin_m:g}, {way} and {pole_way}"
        )
    end, reach = rig.rail_half_length_m - margin_m, rig.com_distance_m or 0.0
    if not end > (1 + spread) * reach:
        raise BadInputError(
            f"rail guard: expected rail_half_length_m above {margin_m + (1 + spread) * reach:.4g} "
            f"m ({margin_m:g} m, and {1 + spread:g} times com_distance_m, which is {reach:.4g} "
            f"m), found {rig.rail_half_length_m:g} m: measure both, and correct the twin file"
        )
    more = (1 + spread) / (1 - spread)
    gain = rig.force_per_pwm_n / rig.total_mass_kg
    friction = rig.cart_viscous_n_s_m / rig.total_mass_kg
    return RailGuard(
        end_m=end,
        reach_m=reach,
        spread=spread,
        push_m_s2=gain * more,
        brake_m_s2=gain / more,
        friction_1_s=friction / more,
        limit=limit,
        delay_s=delay_s,
        hold_s=hold_s,
        back=back,
        patience_s=patience_s,
        way=way,
        pole_way=pole_way,
    )


@dataclass(frozen=True)
class Guarded:
    """Hold what may be applied, and why.

    pwm: PWM fraction.
    in_vain_s: s; how long the cart has been pushed back without effect.
    reason: None when the request is applied as it is.
    """

    pwm: float
    in_vain_s: float = 0.0
    reason: Reason | None = None


@dataclass(frozen=True)
class Seen:
    """Hold what the guard looks at.

    state: the last sample.
    age_s: s; its age.
    applied: PWM fraction, the last command that was applied.
    """

    state: RigState
    age_s: float
    applied: float


def guard_command(
    request: float, seen: Seen, in_vain_s: float, passed_s: float, guard: RailGuard
) -> Guarded:
    """Return what of a command keeps the cart on the rail.

    A drive that does not bring the cart back within the guard's patience is switched off until a
    person has moved the cart.

    request: PWM fraction.
    seen: the last sample.
    in_vain_s: s; from the last decision.
    passed_s: s, since the last decision.
    """
    side = math.copysign(1.0, seen.state.cart_m)  # the nearer end is decided last
    outward, forced = request * guard.way, False
    for towards in (-side, side):
        there, then = _move(
            *find_outermost(seen.state, towards, guard), guard.limit, seen.age_s, guard
        )
        there, then = _move(there, then, towards * seen.applied * guard.way, guard.delay_s, guard)
        most, forced = _find_largest_command(there, then, guard)
        outward = towards * min(towards * outward, most)
    pwm = outward * guard.way
    vain_s = in_vain_s + passed_s if forced and side * seen.state.cart_m_s > -AWAY_M_S else 0.0
    if vain_s > guard.patience_s:
        return Guarded(0.0, vain_s, Reason.RAIL_NOT_HELD)
    return Guarded(pwm, vain_s, None if pwm == request else Reason.RAIL_BRAKING)


def find_outermost(state: RigState, towards: float, guard: RailGuard) -> tuple[float, float]:
    """Return position and velocity of the centre of mass, as far out as the guard has to assume.

    towards: the end, +1 or -1. Returns m and m/s, both positive towards that end.
    """
    sideways = guard.reach_m * math.sin(state.pole_rad)
    sideways_m_s = guard.reach_m * math.cos(state.pole_rad) * state.pole_rad_s
    unsure = guard.spread if guard.pole_way else 1 + guard.spread
    return (
        towards * (state.cart_m - guard.pole_way * sideways) + unsure * abs(sideways),
        towards * (state.cart_m_s - guard.pole_way * sideways_m_s) + unsure * abs(sideways_m_s),
    )


def compute_braking_distance(speed: float, guard: RailGuard) -> float:
    """Return the distance (m) that the cart still runs at a speed (m/s) under the full brake.

    It is 0 for a cart that does not run outwards. With the brake's deceleration b and friction
    over
    mass c, v' = -b - c v gives v/c - b/c^2 log(1 + c v/b).
    """
    if speed <= 0:
        return 0.0
    brake, c = guard.brake_m_s2 * guard.limit, guard.friction_1_s
    if c * speed < 1e-4 * brake:
        return speed * speed / (2 * brake)
    return speed / c - brake / c**2 * math.log1p(c * speed / brake)


def _find_largest_command(q: float, speed: float, guard: RailGuard) -> tuple[float, bool]:
    """Return the largest safe command towards an end, and whether even the full brake is too late.

    q, speed: m and m/s, positive towards the end.
    """
    end = guard.end_m - (1 + guard.spread) * guard.reach_m

    def stops(command: float) -> bool:
        there, then = _move(q, speed, command, guard.hold_s, guard)
        return there + compute_braking_distance(then, guard) <= end

    if stops(guard.limit):
        return guard.limit, False
    if not stops(-guard.limit):
        return _send_back(speed, guard), True
    low, high = -guard.limit, guard.limit
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if stops(middle) else (low, middle)
    return low, False


def _move(
    q: float, speed: float, command: float, seconds: float, guard: RailGuard
) -> tuple[float, float]:
    """Return position and speed towards the end after a command, as far out as assumed."""
    acceleration = command * (guard.push_m_s2 if command > 0 else guard.brake_m_s2)
    return q + speed * seconds + 0.5 * acceleration * seconds**2, speed + acceleration * seconds


def _send_back(speed: float, guard: RailGuard) -> float:
    """Return the command for a cart that is too far out: brake it, then send it back slowly."""
    if speed > AWAY_M_S:
        return -guard.limit
    return -guard.back * guard.limit if speed > -BACK_M_S else 0.0
