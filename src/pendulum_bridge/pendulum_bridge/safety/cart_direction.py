"""Which way a positive command moves the measured cart, as the cart's own motion shows it.

A twin file can give the wrong direction: a mirrored encoder, a swapped pair of wires. The rail
guard would then push the cart outwards where it means to brake. Each stretch of a push is a vote:
for the given direction when the cart gains speed along it, against it when the cart gains speed
the other way. Friction never gives a cart speed, so a vote against needs another force: a drive
the other way, or a hand. Several votes in a row turn the direction.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from pendulum_bridge.safety.rail_guard import RailGuard
from pendulum_bridge.safety.reset import SwingDown
from pendulum_bridge.safety.rig_state import RigState

SETTLING_S = 0.05  # of a push, in which a late command before it may still act
LONGEST_GAP_S = 0.05  # between samples; after a longer gap nobody knows what acted
LEAST_GAIN_M_S = 0.15  # gain of speed that a stretch must promise; noise and tilt give less
LEAST_PUSH_M_S2 = 0.5  # a weaker push is no stretch: a tilted rail gives as much
LEAST_SHARE = 0.5  # of the promised gain that is a vote
VOTES = 3  # in a row that turn the direction


@dataclass(frozen=True)
class CartDirection:
    """Hold what the pushes so far have shown.

    turned: whether the cart moves against the direction that the twin file gives.
    votes: votes in a row against the direction that is believed.
    sign: of the push under way, 1 or -1; 0 for none.
    seconds: s; age of the push.
    promised_m_s: m/s; gain of speed that the stretch under way promises, at least.
    began: the sample at which the stretch began.
    """

    turned: bool = False
    votes: int = 0
    sign: int = 0
    seconds: float = 0.0
    promised_m_s: float = 0.0
    began: RigState | None = None


def follow_cart(
    direction: CartDirection, state: RigState, applied: float, gap_s: float, guard: RailGuard
) -> CartDirection:
    """Return the direction after a sample.

    applied: PWM fraction; the command since the last sample.
    gap_s: s, since the last sample.
    guard: of the direction that the twin file gives.
    """
    push_m_s2 = guard.brake_m_s2 * abs(applied)
    sign = int(math.copysign(1, applied)) if push_m_s2 >= LEAST_PUSH_M_S2 else 0
    if sign == 0 or sign != direction.sign or gap_s > LONGEST_GAP_S:
        return replace(direction, sign=sign, seconds=0.0, promised_m_s=0.0, began=None)
    direction = replace(direction, seconds=direction.seconds + gap_s)
    if direction.began is None:
        settled = direction.seconds >= SETTLING_S
        return replace(direction, began=state) if settled else direction
    promised = direction.promised_m_s + push_m_s2 * gap_s
    if promised < LEAST_GAIN_M_S:
        return replace(direction, promised_m_s=promised)
    ahead = sign * guard.way * (-1 if direction.turned else 1)
    direction = _count_vote(direction, direction.began, state, promised, ahead, guard)
    return replace(direction, promised_m_s=0.0, began=state)


def turn_guard(guard: RailGuard, direction: CartDirection) -> RailGuard:
    """Return the rail guard for the direction that is believed.

    A turned direction leaves open whether the command or the cart's encoder is mirrored, and so
    which way the pole hangs beside the cart: 0, see `RailGuard`.
    """
    return replace(guard, way=-guard.way, pole_way=0) if direction.turned else guard


def turn_swing_down(plan: SwingDown, direction: CartDirection) -> SwingDown:
    """Return the reset for the direction that is believed; it then leaves the pole to itself."""
    return replace(plan, way=-plan.way, pole_way=0) if direction.turned else plan


def _count_vote(
    direction: CartDirection,
    before: RigState,
    after: RigState,
    promised_m_s: float,
    ahead: int,
    guard: RailGuard,
) -> CartDirection:
    """Return the direction with the vote of a stretch.

    ahead: 1 or -1; where the push should move the cart.
    """
    unsure_m_s = (1 + guard.spread) * guard.reach_m * abs(_swing(after) - _swing(before))
    least = LEAST_SHARE * promised_m_s + unsure_m_s
    if _compute_gain(before, after, -ahead) >= least:
        votes = direction.votes + 1
        return replace(direction, turned=direction.turned != (votes == VOTES), votes=votes % VOTES)
    if _compute_gain(before, after, ahead) >= least:
        return replace(direction, votes=0)
    return direction


def _compute_gain(before: RigState, after: RigState, towards: int) -> float:
    """Return the speed (m/s) that the cart has gained towards a side, 1 or -1."""
    return max(towards * after.cart_m_s, 0.0) - max(towards * before.cart_m_s, 0.0)


def _swing(state: RigState) -> float:
    """Return the speed of the pole's centre of mass beside the cart, rad/s for each m of reach.

    The pole pushes the cart by as much as this changes.
    """
    return math.cos(state.pole_rad) * state.pole_rad_s
