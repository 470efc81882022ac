"""The checks that move the cart: what a command and what the reset flag do."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass

import numpy as np

from pendulum_bridge.doctor import response
from pendulum_bridge.doctor.broken_off import explain_broken_off
from pendulum_bridge.doctor.derivatives import check_order, check_velocities_moving
from pendulum_bridge.doctor.directions import (
    PoleAnswer,
    check_directions,
    compute_lever_per_m,
    measure_pole_answer,
)
from pendulum_bridge.doctor.driving import STOOD, Driven, play_plan
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
from pendulum_bridge.safety.limits import Limits
from pendulum_bridge.safety.signs import find_ways
from pendulum_bridge.safety.state import Rules, make_rules
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin
from pendulum_twin.rig import Rig

CHECKS = tuple(Check)[list(Check).index(Check.MOVES) :]
FREE_SHARE = 0.5  # of the rail, around the middle, where the cart has to stand at first
LARGEST_SHARE = 0.8  # of the limit, for a push at a standing cart
SLOWEST_RISE_S = 6.0  # to LARGEST_SHARE
RISE_M_S3 = 2.0  # how fast the pushing acceleration rises
STIFF_SHARE = 0.4  # of the limit; a cart that takes more to move is stiff
PUSHES_M_S2, PUSH_S = (1.0, 2.5), 0.12
KICK_M = 0.05  # travel of the full command
FEWEST_SAMPLES = 4  # of a push
LARGER_PUSHES = 3  # of the larger small push: its steps show how the latency scatters
ASIDE_M = 0.1  # where the cart is put before the rig's own swing-down
RESET_S, IGNORED_S = 35.0, 6.0


@dataclass(frozen=True)
class Drive:
    """Hold what the pushes are computed from.

    twin: the rig as the twin file has it.
    rest: what the rig reports at rest.
    period_s: sample period.
    gain: m/s^2 a unit of command, by the twin file.
    limit: largest command, PWM fraction.
    """

    twin: Twin
    rest_state: AtRest
    period_s: float
    gain: float
    limit: float

    @property
    def rise_per_s(self) -> float:
        """Return the rise of the first command, PWM fraction a second."""
        return max(RISE_M_S3 / self.gain, LARGEST_SHARE * self.limit / SLOWEST_RISE_S)

    @property
    def frictionless(self) -> float:
        """Return the command at which a cart without friction would have moved by MOVED_M."""
        return self.rise_per_s * float((6 * MOVED_M / (self.gain * self.rise_per_s)) ** (1 / 3))

    def make_rules(self, way: int, pole_way: int) -> Rules:
        """Return the driver's rules for these signs."""
        return make_rules(
            self.twin.rig, Limits(), way=way, pole_way=pole_way, period_s=self.period_s
        )

    def make_homing(self, way: int, dry: float) -> Homing:
        """Return how the cart is brought back.

        way: of the cart under a positive command.
        dry: command (PWM fraction) that friction takes.
        """
        return Homing(way, 1 / self.gain, dry)


def explain_refusal(findings: tuple[Finding, ...], twin: Twin) -> str:
    """Return why the cart should not be moved after the findings; empty when it may be moved."""
    unsafe = (Fault.MOVING, Fault.SPIKES, Fault.NOISY)
    for finding in findings:
        if finding.verdict is Verdict.FAIL or finding.fault in unsafe:
            return f"not before '{finding.check.group}, {finding.check.title}' is mended"
    if not twin.rig.has_cart:
        return "the twin file has no cart"
    return ""


def move_cart(
    wire: Wire, twin: Twin, rest_state: AtRest, rate_hz: float
) -> Generator[Finding, None, str]:
    """Push the cart and yield the findings in the order of CHECKS, each when it is made.

    Returns why the remaining checks could not be made; empty when all were made.
    Raises BadInputError when the network refuses a command.
    """
    period_s = 1 / rate_hz
    try:
        drive = _make_drive(twin, rest_state, period_s)
        rules = drive.make_rules(*find_ways(twin.effects))
    except BadInputError as error:
        return str(error)
    nudged = play_plan(
        wire, plan_nudge(LARGEST_SHARE * drive.limit, drive.rise_per_s), rules, signs_known=False
    )
    moves = check_moves(nudged, drive)
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
    answer = measure_pole_answer(grid, rest_state.pole_rad, compute_lever_per_m(twin.rig))
    signs = (nudged.seen.way, answer.way or find_ways(twin.effects)[1])
    dry = 0.9 * max(nudged.seen.breakaway - drive.frictionless, 0.0)
    return (yield from _push_cart(wire, drive, signs, dry)) or (
        yield from _check_reset(wire, drive, signs, dry)
    )


def check_moves(nudged: Driven[Nudged], drive: Drive) -> Finding:
    """Return whether the cart moves, both ways, and how large a command that takes."""
    stiff = STIFF_SHARE * drive.limit
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
        return explain_broken_off(Check.MOVES, expected, nudged, drive.period_s)
    if seen.blind:
        return Finding(
            Check.MOVES, expected, "the pole swings, and the cart seems to stand", Fault.CART_BLIND
        )
    if seen.back is None:
        observed = (
            f"it moved at {seen.forth:+.3f}, and not back at commands down to -{most:.2f}, "
            "or not in time"
        )
        return Finding(Check.MOVES, expected, observed, Fault.MOTION_BROKEN_OFF)
    fault = Fault.STIFF if seen.breakaway - drive.frictionless > stiff else None
    return Finding(
        Check.MOVES,
        expected,
        f"it had moved {1e3 * MOVED_M:g} mm at {seen.forth:+.3f} and {seen.back:+.3f}",
        fault,
    )


def _push_cart(
    wire: Wire, drive: Drive, signs: tuple[int, int], dry: float
) -> Generator[Finding, None, str]:
    rig, rules = drive.twin.rig, drive.make_rules(*signs)
    doublets = _make_doublets(drive, dry)
    pushed = play_plan(wire, plan_pushes(doublets, drive.make_homing(signs[0], dry)), rules)
    if pushed.broken_off:
        yield explain_broken_off(
            Check.DIRECTIONS, "small pushes both ways, played to the end", pushed, drive.period_s
        )
        return pushed.broken_off
    grid = resample(pushed.track, drive.period_s)
    yield _check_signs(grid, drive, signs)
    small = 1.01 * doublets[1].pwm
    answer = response.measure_response(pushed.track, grid, rig, signs[1], small)
    yield response.check_latency(answer, drive.period_s)
    yield response.check_acceleration(
        answer, drive.gain, rules.guard.brake_m_s2, rules.guard.push_m_s2
    )
    yield response.check_clipping(answer, drive.limit)
    cart = pushed.track.samples[:, CART]
    yield check_rail(float(cart.min()), float(cart.max()), rig.rail_half_length_m)
    return ""


def _check_signs(grid: Grid, drive: Drive, signs: tuple[int, int]) -> Finding:
    rig = drive.twin.rig
    answer = (
        measure_pole_answer(grid, drive.rest_state.pole_rad, compute_lever_per_m(rig))
        if rig.has_pole
        else PoleAnswer(0.0, 0.0, False)
    )
    return check_directions(signs[0], answer, find_ways(drive.twin.effects), rig.has_pole)


def _check_reset(
    wire: Wire, drive: Drive, signs: tuple[int, int], dry: float
) -> Generator[Finding, None, str]:
    rules = drive.make_rules(*signs)
    aside = play_plan(wire, plan_homing(ASIDE_M, drive.make_homing(signs[0], dry)), rules)
    if aside.broken_off:
        yield explain_broken_off(
            Check.RESET, f"the cart to go {1e3 * ASIDE_M:g} mm aside first", aside, drive.period_s
        )
        return aside.broken_off
    plan = plan_reset_watch(drive.rest_state.pole_rad, RESET_S, IGNORED_S)
    watched = play_plan(wire, plan, rules, reset=True)
    expected = f"the rig to swing down by itself within {RESET_S:g} s"
    if watched.seen is None:
        yield explain_broken_off(Check.RESET, expected, watched, drive.period_s)
    elif not watched.seen.moved:
        observed = (
            f"a cart that did not come to the middle within {IGNORED_S:g} s, "
            f"from {1e3 * ASIDE_M:g} mm beside it"
        )
        yield Finding(Check.RESET, expected, observed, Fault.RESET_IGNORED)
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


def _make_drive(twin: Twin, rest_state: AtRest, period_s: float) -> Drive:
    """Return the base of the pushes; raise BadInputError when the cart should not be moved."""
    rig: Rig = twin.rig
    if not rig.force_per_pwm_n or rig.rail_half_length_m is None:
        raise BadInputError(
            "not with a twin file without force_per_pwm_n above 0 and rail_half_length_m"
        )
    if abs(rest_state.cart_m) > FREE_SHARE * rig.rail_half_length_m:
        raise BadInputError(
            f"not with the cart at {rest_state.cart_m:.2f} m: move it to the middle by hand"
        )
    limit = min(Limits().magnitude, rig.pwm_limit or Limits().magnitude)
    return Drive(twin, rest_state, period_s, rig.force_per_pwm_n / rig.total_mass_kg, limit)


def _make_doublets(drive: Drive, dry: float) -> tuple[Doublet, ...]:
    """Return small pushes of two sizes beyond dry friction, and a short push at the limit.

    Without the push at the limit where samples are too sparse for it.
    dry: command (PWM fraction) that friction takes.
    """
    pwms = [
        min(dry + push / drive.gain, LARGEST_SHARE * drive.limit * share)
        for push, share in zip(PUSHES_M_S2, (0.4, 1.0), strict=True)
    ]
    seconds = max(PUSH_S, FEWEST_SAMPLES * drive.period_s)
    small = (Doublet(pwms[0], seconds), *[Doublet(pwms[1], seconds)] * LARGER_PUSHES)
    kick = Doublet(drive.limit, float((KICK_M / (drive.gain * drive.limit)) ** 0.5))
    return (*small, kick) if kick.seconds >= FEWEST_SAMPLES * drive.period_s else small
