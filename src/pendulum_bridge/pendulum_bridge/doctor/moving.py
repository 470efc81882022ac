"""The checks that move the cart: what a command does, and what the reset flag does."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass

import numpy as np

from pendulum_bridge.doctor import response as answering
from pendulum_bridge.doctor.broken_off import explain_broken_off
from pendulum_bridge.doctor.derivatives import check_order, check_velocities_moving
from pendulum_bridge.doctor.directions import (
    PoleAnswer,
    check_directions,
    compute_lever_per_m,
    measure_pole_answer,
)
from pendulum_bridge.doctor.driving import STOOD, Driven, drive
from pendulum_bridge.doctor.faults import Fault, Verdict
from pendulum_bridge.doctor.findings import Check, Finding, skip_check
from pendulum_bridge.doctor.pushes import (
    MOVED_M,
    Doublet,
    Homing,
    Nudged,
    plan_homing,
    plan_nudge,
    plan_pushes,
    plan_reset_watch,
)
from pendulum_bridge.doctor.resting import CART, AtRest
from pendulum_bridge.doctor.track import Grid, resample
from pendulum_bridge.doctor.wire import Wire
from pendulum_bridge.doctor.zeros import check_rail
from pendulum_bridge.safety.decide import Rules, make_rules
from pendulum_bridge.safety.limits import Limits
from pendulum_bridge.safety.signs import find_ways
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin
from pendulum_twin.rig import Rig

CHECKS = tuple(Check)[list(Check).index(Check.MOVES) :]
FREE_SHARE = 0.5  # of the rail, on which the cart has to stand before it is moved
MOST_SHARE = 0.8  # of the limit, up to which a standing cart is pushed
FULL_S = 6.0  # for the slowest rise to that
RISE_M_S3 = 2.0  # how fast the pushing acceleration rises
STIFF_SHARE = 0.4  # of the limit; a cart that takes more to move is stiff
PUSHES_M_S2, PUSH_S = (1.0, 2.5), 0.12
KICK_M = 0.05  # travel of the full command
FEWEST_SAMPLES = 4  # of a push
ASIDE_M = 0.1  # where the cart is put before the rig's own swing-down is asked for
RESET_S, IGNORED_S = 35.0, 6.0


@dataclass(frozen=True)
class Drive:
    """Hold what the pushes are computed from: gain m/s^2 a unit of command by the twin file, limit PWM fraction."""

    twin: Twin
    rest: AtRest
    period_s: float
    gain: float
    limit: float

    @property
    def rise_per_s(self) -> float:
        """Return how fast the first command rises, PWM a second."""
        return max(RISE_M_S3 / self.gain, MOST_SHARE * self.limit / FULL_S)

    @property
    def frictionless(self) -> float:
        """Return the command at which a cart without friction has moved so far that it is seen."""
        return self.rise_per_s * float((6 * MOVED_M / (self.gain * self.rise_per_s)) ** (1 / 3))

    def rules(self, way: int, pole_way: int) -> Rules:
        """Return the driver's rules for these signs."""
        return make_rules(
            self.twin.rig, Limits(), way=way, pole_way=pole_way, period_s=self.period_s
        )

    def homing(self, way: int, dry: float) -> Homing:
        """Return how the cart is brought back; way and dry (PWM fraction): as its first moves showed them."""
        return Homing(way, 1 / self.gain, dry)


def explain_refusal(findings: tuple[Finding, ...], twin: Twin) -> str:
    """Return why the cart should not be moved after these findings; empty when it may."""
    for each in findings:
        if each.verdict is Verdict.FAIL or each.fault in (Fault.MOVING, Fault.SPIKES, Fault.NOISY):
            return f"not before '{each.check.group}, {each.check.title}' is mended"
    if not twin.rig.has_cart:
        return "the twin file has no cart"
    return ""


def move_cart(
    wire: Wire, twin: Twin, rest: AtRest, rate_hz: float
) -> Generator[Finding, None, str]:
    """Push the cart and yield the findings, in the order of CHECKS, as they are made; return why no more could be.

    Raises BadInputError when the network refuses a command.
    """
    period_s = 1 / rate_hz
    try:
        drive_ = _make_drive(twin, rest, period_s)
        rules = drive_.rules(*find_ways(twin.effects))
    except BadInputError as error:
        return str(error)
    nudged = drive(
        wire, plan_nudge(MOST_SHARE * drive_.limit, drive_.rise_per_s), rules, signs_known=False
    )
    moves = check_moves(nudged, drive_)
    yield moves
    if moves.verdict is Verdict.FAIL or nudged.seen is None:
        return "the cart did not move as asked"
    grid = resample(nudged.track, period_s)
    order, velocities = check_order(grid), check_velocities_moving(grid)
    yield order
    yield (
        skip_check(Check.VELOCITIES_MOVING, "the fields are not in their order")
        if order.fault
        else velocities
    )
    if order.fault or velocities.fault:
        return "the samples are not what they should be"
    answer = measure_pole_answer(grid, rest.pole_rad, compute_lever_per_m(twin.rig))
    signs = (nudged.seen.way, answer.way or find_ways(twin.effects)[1])
    dry = 0.9 * max(nudged.seen.breakaway - drive_.frictionless, 0.0)
    return (yield from _push_cart(wire, drive_, signs, dry)) or (
        yield from _check_reset(wire, drive_, signs, dry)
    )


def check_moves(nudged: Driven[Nudged], drive_: Drive) -> Finding:
    """Return whether the cart moves, both ways, and how large a command that takes."""
    stiff = STIFF_SHARE * drive_.limit
    expected = f"the cart to move both ways at commands under {stiff:.2f}, raised slowly"
    seen, most = nudged.seen, float(np.max(np.abs(nudged.track.sent), initial=0.0))
    if nudged.broken_off == STOOD or (seen is not None and seen.forth is None and not seen.blind):
        return Finding(
            Check.MOVES,
            expected,
            f"it did not move at commands up to {most:.2f}",
            Fault.CART_STANDS,
        )
    if seen is None:
        return explain_broken_off(Check.MOVES, expected, nudged, drive_.period_s)
    if seen.blind:
        return Finding(
            Check.MOVES, expected, "the pole swings, and the cart seems to stand", Fault.CART_BLIND
        )
    if seen.back is None:
        found = f"it moved at {seen.forth:+.3f}, and not back at commands down to -{most:.2f}, or not in time"
        return Finding(Check.MOVES, expected, found, Fault.MOTION_BROKEN_OFF)
    fault = Fault.STIFF if seen.breakaway - drive_.frictionless > stiff else None
    return Finding(
        Check.MOVES,
        expected,
        f"it had moved {1e3 * MOVED_M:g} mm at {seen.forth:+.3f} and {seen.back:+.3f}",
        fault,
    )


def _push_cart(
    wire: Wire, drive_: Drive, signs: tuple[int, int], dry: float
) -> Generator[Finding, None, str]:
    rig, rules = drive_.twin.rig, drive_.rules(*signs)
    doublets = _make_doublets(drive_, dry)
    pushed = drive(wire, plan_pushes(doublets, drive_.homing(signs[0], dry)), rules)
    if pushed.broken_off:
        yield explain_broken_off(
            Check.DIRECTIONS, "small pushes both ways, played to the end", pushed, drive_.period_s
        )
        return pushed.broken_off
    grid = resample(pushed.track, drive_.period_s)
    yield _check_signs(grid, drive_, signs)
    small = 1.01 * doublets[1].pwm
    found = answering.measure_response(pushed.track, grid, rig, signs[1], small)
    yield answering.check_latency(found, drive_.period_s)
    yield answering.check_acceleration(
        found, drive_.gain, rules.guard.brake_m_s2, rules.guard.push_m_s2
    )
    yield answering.check_clipping(found, drive_.limit)
    cart = pushed.track.samples[:, CART]
    yield check_rail(float(cart.min()), float(cart.max()), rig.rail_half_length_m)
    return ""


def _check_signs(grid: Grid, drive_: Drive, signs: tuple[int, int]) -> Finding:
    rig = drive_.twin.rig
    answer = (
        measure_pole_answer(grid, drive_.rest.pole_rad, compute_lever_per_m(rig))
        if rig.has_pole
        else PoleAnswer(0.0, 0.0, False)
    )
    return check_directions(signs[0], answer, find_ways(drive_.twin.effects), rig.has_pole)


def _check_reset(
    wire: Wire, drive_: Drive, signs: tuple[int, int], dry: float
) -> Generator[Finding, None, str]:
    rules = drive_.rules(*signs)
    aside = drive(wire, plan_homing(ASIDE_M, drive_.homing(signs[0], dry)), rules)
    if aside.broken_off:
        yield explain_broken_off(
            Check.RESET, f"the cart to go {1e3 * ASIDE_M:g} mm aside first", aside, drive_.period_s
        )
        return aside.broken_off
    plan = plan_reset_watch(drive_.rest.pole_rad, RESET_S, IGNORED_S)
    watched = drive(wire, plan, rules, reset=True)
    expected = f"the rig to swing down by itself within {RESET_S:g} s"
    if watched.seen is None:
        yield explain_broken_off(Check.RESET, expected, watched, drive_.period_s)
    elif not watched.seen.moved:
        found = f"a cart that did not come to the middle within {IGNORED_S:g} s, from {1e3 * ASIDE_M:g} mm beside it"
        yield Finding(Check.RESET, expected, found, Fault.RESET_IGNORED)
    elif watched.seen.rest_s is None:
        yield Finding(
            Check.RESET,
            expected,
            "it moved, and did not come to rest in the middle",
            Fault.RESET_LATE,
        )
    else:
        yield Finding(
            Check.RESET, expected, f"at rest in the middle after {watched.seen.rest_s:.1f} s"
        )
    return ""


def _make_drive(twin: Twin, rest: AtRest, period_s: float) -> Drive:
    """Return what the pushes are computed from; raise BadInputError when the cart should not be moved."""
    rig: Rig = twin.rig
    if not rig.force_per_pwm_n or rig.rail_half_length_m is None:
        raise BadInputError(
            "not with a twin file without force_per_pwm_n above 0 and rail_half_length_m"
        )
    if abs(rest.cart_m) > FREE_SHARE * rig.rail_half_length_m:
        raise BadInputError(
            f"not with the cart at {rest.cart_m:.2f} m: move it to the middle by hand"
        )
    limit = min(Limits().magnitude, rig.pwm_limit or Limits().magnitude)
    return Drive(twin, rest, period_s, rig.force_per_pwm_n / rig.total_mass_kg, limit)


def _make_doublets(drive_: Drive, dry: float) -> tuple[Doublet, ...]:
    """Return two small pushes over what dry friction takes, and a short one at the limit where samples are dense enough."""
    pwms = [
        min(dry + push / drive_.gain, MOST_SHARE * drive_.limit * share)
        for push, share in zip(PUSHES_M_S2, (0.4, 1.0), strict=True)
    ]
    seconds = max(PUSH_S, FEWEST_SAMPLES * drive_.period_s)
    small = tuple(Doublet(pwm, seconds) for pwm in pwms)
    kick = Doublet(drive_.limit, float((KICK_M / (drive_.gain * drive_.limit)) ** 0.5))
    return (*small, kick) if kick.seconds >= FEWEST_SAMPLES * drive_.period_s else small
