"""Plans that push the cart, only as hard as the cart needs.

A plan is a generator: it takes the moments (samples) and yields the command (PWM fraction) to hold
until the next moment; it returns what it has seen. The first command, before any moment, is 0. The
player (`driving.play_plan`) limits the commands.
"""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import dataclass
from statistics import median_high

from pendulum_bridge.safety.reset import Rest, clip
from pendulum_bridge.safety.rig_state import RigState

MEDIAN_SAMPLES = 3  # a single sample may be a spike
MOVED_M = 0.005  # a cart that has come so far does move
ROOM_M = 0.15  # largest distance from the begin of a plan
TILT_RAD = 0.06  # a pole so far from hanging over a standing cart: the cart's encoder is blind
PAUSE_S = 0.3
HOMING_S = 3.0
# Within these the cart has come home; a swinging pole hardly lets it stand.
NEAR_M, SLOW_ENOUGH_M_S = 0.03, 0.05
STANDS_M_S = 0.02  # a slower cart coasts no further than 0.03 m
POSITION_1_S2, VELOCITY_1_S, LARGEST_M_S2 = 4.0, 3.5, 1.5  # of homing
# Of the command against dry friction: prediction time, and speed of its full size.
AHEAD_S, SLOW_M_S = 0.05, 0.02


@dataclass(frozen=True)
class Moment:
    """Hold a sample.

    elapsed_s: since the plan began.
    state: of the rig, as measured.
    """

    elapsed_s: float
    state: RigState


type Plan[Seen] = Generator[float, Moment, Seen]


@dataclass(frozen=True)
class Nudged:
    """Hold how the cart answered commands that rise slowly.

    forth, back: positive and negative command (PWM fraction) at which it had moved; None when it
        did not move.
    way: of the measured cart under the positive command, +1 or -1; 0 when it did not move.
    blind: whether the pole swung while the cart seemed to stand.
    """

    forth: float | None = None
    back: float | None = None
    way: int = 0
    blind: bool = False

    @property
    def breakaway(self) -> float:
        """Return the larger size of both commands, PWM fraction; 0 without commands."""
        return max(abs(self.forth or 0.0), abs(self.back or 0.0))


def plan_nudge(most: float, rise_per_s: float) -> Plan[Nudged]:
    """Raise the command from 0 until the cart moves, then lower it until the cart moves back.

    most: largest size of a command.
    rise_per_s: PWM fraction a second.
    """
    moment = yield 0.0
    hanging = moment.state.pole_rad
    begin, start, carts, tilts, pwm = (
        moment.elapsed_s,
        moment.state.cart_m,
        [moment.state.cart_m],
        [0.0],
        0.0,
    )
    while abs(_compute_median(carts) - start) <= MOVED_M:
        if min(tilts[-MEDIAN_SAMPLES:]) > TILT_RAD:
            yield from _take_back(moment, pwm, moment.elapsed_s - begin)
            return Nudged(blind=True)
        if (pwm := rise_per_s * (moment.elapsed_s - begin)) > most:
            return Nudged()
        moment = yield pwm
        carts.append(moment.state.cart_m)
        tilts.append(abs(math.remainder(moment.state.pole_rad - hanging, math.tau)))
    way, forth = int(math.copysign(1, _compute_median(carts) - start)), pwm
    moment = yield from _pause(moment)
    begin, carts = moment.elapsed_s, [moment.state.cart_m]
    furthest = moment.state.cart_m
    while way * (furthest - _compute_median(carts)) <= MOVED_M:
        pwm = -rise_per_s * (moment.elapsed_s - begin)
        if pwm < -most or abs(_compute_median(carts) - start) > ROOM_M:
            return Nudged(forth, None, way)
        moment = yield pwm
        carts.append(moment.state.cart_m)
        # the cart still coasts from the first push for a while
        furthest = way * max(way * furthest, way * _compute_median(carts))
    yield from _pause(moment)
    return Nudged(forth, pwm, way)


@dataclass(frozen=True)
class Homing:
    """Hold the controller that brings the cart to a place.

    way: of the measured cart under a positive command, +1 or -1.
    per_m_s2: command (PWM fraction) for 1 m/s^2.
    dry: command (PWM fraction) that friction and dead zone take.
    """

    way: int
    per_m_s2: float
    dry: float


def plan_homing(target_m: float, homing: Homing) -> Plan[None]:
    """Bring the cart to target_m, as near as it comes within HOMING_S."""
    moment = yield 0.0
    yield from _bring_home(moment, target_m, homing, STANDS_M_S)


@dataclass(frozen=True)
class Doublet:
    """Hold a push that ends where it began: `pwm` for `seconds`, -`pwm` twice as long, `pwm`."""

    pwm: float
    seconds: float


def plan_pushes(doublets: tuple[Doublet, ...], homing: Homing) -> Plan[None]:
    """Play the doublets, each from the middle, and bring the cart back to the middle."""
    moment = yield 0.0
    for doublet in doublets:
        moment = yield from _bring_home(moment, 0.0, homing)
        moment = yield from _pause(moment)
        begin = moment.elapsed_s
        while (phase := (moment.elapsed_s - begin) / doublet.seconds) < 4.0:
            moment = yield -doublet.pwm if 1.0 <= phase < 3.0 else doublet.pwm
    yield from _bring_home(moment, 0.0, homing)


@dataclass(frozen=True)
class ResetSeen:
    """Hold what the rig's own swing-down did.

    moved: whether the cart came half of the way to the middle, further than it coasts.
    rest_s: when cart and pole came to rest; None when they did not.
    """

    moved: bool
    rest_s: float | None


def plan_reset_watch(hanging_rad: float, deadline_s: float, ignored_s: float) -> Plan[ResetSeen]:
    """Send PWM 0 until the pendulum hangs still in the middle, or until the deadline.

    hanging_rad: angle that the rig reports while the pole hangs.
    ignored_s: time within which the cart has to come nearer to the middle.
    """
    moment, moved, resting, limits = (yield 0.0), False, 0, Rest()
    start_m = abs(moment.state.cart_m)
    while moment.elapsed_s < deadline_s and (moved or moment.elapsed_s < ignored_s):
        state = moment.state
        moved = moved or abs(state.cart_m) < 0.5 * start_m
        hangs = abs(math.remainder(state.pole_rad - hanging_rad, math.tau)) < 2 * limits.pole_rad
        still = abs(state.cart_m_s) < limits.cart_m_s and abs(state.pole_rad_s) < limits.pole_rad_s
        resting = resting + 1 if hangs and still and abs(state.cart_m) < limits.cart_m else 0
        if moved and resting >= limits.samples:
            return ResetSeen(True, moment.elapsed_s)
        moment = yield 0.0
    return ResetSeen(moved, None)


def _pause(moment: Moment) -> Generator[float, Moment, Moment]:
    end = moment.elapsed_s + PAUSE_S
    while moment.elapsed_s < end:
        moment = yield 0.0
    return moment


def _compute_median(values: list[float]) -> float:
    """Return the (upper) median of the last MEDIAN_SAMPLES values."""
    return median_high(values[-MEDIAN_SAMPLES:])


def _take_back(moment: Moment, pwm: float, seconds: float) -> Generator[float, Moment, None]:
    """Take back the momentum of a command that rose to pwm in so many seconds, unseen."""
    end = moment.elapsed_s + seconds
    while moment.elapsed_s < end:
        moment = yield -0.5 * pwm


def _bring_home(
    moment: Moment, target_m: float, homing: Homing, slow_m_s: float = SLOW_ENOUGH_M_S
) -> Generator[float, Moment, Moment]:
    end, still = moment.elapsed_s + HOMING_S, 0
    while moment.elapsed_s < end and still < MEDIAN_SAMPLES:
        off, speed = moment.state.cart_m - target_m, moment.state.cart_m_s
        still = still + 1 if abs(off) < NEAR_M and abs(speed) < slow_m_s else 0
        wanted = clip(-(POSITION_1_S2 * off + VELOCITY_1_S * speed), LARGEST_M_S2)
        going = clip((speed + AHEAD_S * wanted) / SLOW_M_S, 1.0) if still == 0 else 0.0
        moment = yield homing.way * (homing.per_m_s2 * wanted + homing.dry * going)
    return moment
