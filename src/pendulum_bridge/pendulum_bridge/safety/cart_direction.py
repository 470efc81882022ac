"""Which way a positive command moves the measured cart, as the cart's own motion shows it.

A twin file can give the wrong direction: a mirrored encoder, a swapped pair of wires. The rail
guard would then push the cart outwards where it means to brake. Each stretch of a push is a vote:
for the given direction when the cart gains speed along it, against it when the cart gains speed
the other way. Friction never gives a cart speed, so a vote against needs another force: a drive
the other way, or a hand. A hand shoves one way, and a controller pushes against the hand; so the
direction is decided by pushes of both signs, and decided once: wires do not change while a rig
runs. Commands of a drive that is later than SETTLING_S can show the wrong direction.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from pendulum_bridge.safety.rail_guard import RailGuard
from pendulum_bridge.safety.reset import SwingDown
from pendulum_bridge.safety.rig_state import RigState

SETTLING_S = 0.12  # of a push, in which a late command before it may still act
MOST_PERIODS = 5  # between samples; after a longer gap nobody knows what acted
LEAST_GAIN_M_S = 0.15  # gain of speed that a stretch must promise; noise and tilt give less
LEAST_PUSH_M_S2 = 0.5  # a weaker push is no stretch: a tilted rail gives as much
LEAST_SHARE = 0.5  # of the promised gain that is a vote
VOTES = 3  # that decide: of pushes of both signs, with none of the other side between
DOUBTS = 2  # votes against that leave the direction in doubt


@dataclass(frozen=True)
class Push:
    """Hold the push under way.

    sign: 1 or -1; 0 for none.
    seconds: s; its age.
    promised_m_s: m/s; gain of speed that the stretch under way promises, at least.
    began: the sample at which the stretch began; None before the push has settled.
    """

    sign: int = 0
    seconds: float = 0.0
    promised_m_s: float = 0.0
    began: RigState | None = None


@dataclass(frozen=True)
class CartDirection:
    """Hold what the pushes so far have shown.

    decided: whether pushes of both signs have shown the direction.
    turned: whether the cart moves against the direction that the twin file gives.
    against: whether the last votes were against that direction.
    votes: number of the last votes, of pushes of negative and of positive sign.
    push: the push under way.
    """

    decided: bool = False
    turned: bool = False
    against: bool = False
    votes: tuple[int, int] = (0, 0)
    push: Push = Push()

    @property
    def in_doubt(self) -> bool:
        """Whether the cart has moved against its pushes, and the direction is not decided."""
        return not self.decided and self.against and sum(self.votes) >= DOUBTS


def follow_cart(
    direction: CartDirection,
    state: RigState,
    applied: float,
    gap_s: float,
    period_s: float,
    guard: RailGuard,
) -> CartDirection:
    """Return the direction after a sample.

    applied: PWM fraction; the last command. `end_push` is called when its sign changes.
    gap_s: s, since the last sample, at least.
    period_s: s, from sample to sample.
    guard: of the direction that the twin file gives.
    """
    if direction.decided:
        return direction
    push = direction.push
    push_m_s2 = guard.brake_m_s2 * abs(applied)
    sign = int(math.copysign(1, applied)) if push_m_s2 >= LEAST_PUSH_M_S2 else 0
    if sign == 0 or sign != push.sign or gap_s > MOST_PERIODS * period_s:
        return replace(direction, push=Push(sign))
    push = replace(push, seconds=push.seconds + gap_s)
    if push.began is None:
        settled = push.seconds >= SETTLING_S
        return replace(direction, push=replace(push, began=state if settled else None))
    promised = push.promised_m_s + push_m_s2 * gap_s
    if promised < LEAST_GAIN_M_S:
        return replace(direction, push=replace(push, promised_m_s=promised))
    direction = _count_vote(direction, push.began, state, promised, guard)
    return replace(direction, push=replace(push, promised_m_s=0.0, began=state))


def end_push(direction: CartDirection) -> CartDirection:
    """Return the direction after the command's sign has changed, however briefly."""
    return replace(direction, push=Push())


def turn_guard(guard: RailGuard, direction: CartDirection) -> RailGuard:
    """Return the rail guard for the direction that is believed.

    A turned direction leaves open whether the command or the cart's encoder is mirrored, and so
    which way the pole hangs beside the cart: 0, see `RailGuard`.
    """
    return replace(guard, way=-guard.way, pole_way=0) if direction.turned else guard


def turn_swing_down(plan: SwingDown, direction: CartDirection) -> SwingDown:
    """Return the reset for the direction that is believed.

    A turned direction leaves the pole to itself: which push damps its swing is not known. The
    cart is brought to the middle; where the pole swings long, the reset ends late.
    """
    return replace(plan, way=-plan.way, pole_way=0) if direction.turned else plan


def _count_vote(
    direction: CartDirection,
    before: RigState,
    after: RigState,
    promised_m_s: float,
    guard: RailGuard,
) -> CartDirection:
    """Return the direction with the vote of a stretch."""
    sign = direction.push.sign
    ahead = sign * guard.way
    unsure_m_s = (1 + guard.spread) * guard.reach_m * abs(_swing(after) - _swing(before))
    least = LEAST_SHARE * promised_m_s + unsure_m_s
    against = _compute_gain(before, after, -ahead) >= least
    if not against and _compute_gain(before, after, ahead) < least:
        return direction
    negative, positive = direction.votes if against == direction.against else (0, 0)
    votes = (negative + (sign < 0), positive + (sign > 0))
    decided = min(votes) > 0 and sum(votes) >= VOTES
    return replace(
        direction, decided=decided, turned=decided and against, against=against, votes=votes
    )


def _compute_gain(before: RigState, after: RigState, towards: int) -> float:
    """Return the speed (m/s) that the cart has gained towards a side, 1 or -1."""
    return max(towards * after.cart_m_s, 0.0) - max(towards * before.cart_m_s, 0.0)


def _swing(state: RigState) -> float:
    """Return the speed of the pole's centre of mass beside the cart, rad/s for each m of reach.

    The pole pushes the cart by as much as this changes.
    """
    return math.cos(state.pole_rad) * state.pole_rad_s
