"""All checks of a rig that sends samples, in their order."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from pendulum_bridge.doctor import moving, standing
from pendulum_bridge.doctor.faults import Verdict
from pendulum_bridge.doctor.findings import Check, Finding, skip_check
from pendulum_bridge.doctor.listening import listen
from pendulum_bridge.doctor.resting import CART
from pendulum_bridge.doctor.standing import Standing
from pendulum_bridge.doctor.wire import Wire
from pendulum_bridge.doctor.zeros import check_rail
from pendulum_twin.model import Twin

NOT_ASKED = "not without --move, which moves the cart"


@dataclass(frozen=True)
class Task:
    """Hold what is to be examined.

    twin: the rig as the twin file has it.
    rate_hz: samples a second.
    listen_s: how long to listen.
    may_move: whether the cart may be moved.
    """

    twin: Twin
    rate_hz: float = 100.0
    listen_s: float = 3.0
    may_move: bool = False


def examine(wire: Wire, task: Task) -> Iterator[Finding]:
    """Yield the findings from Check.SAMPLES on, each when it is made.

    Raises BadInputError when the network refuses a command.
    """
    stood = standing.check_standing(listen(wire, task.listen_s), task.twin, task.rate_hz)
    yield from stood.findings
    why = moving.explain_refusal(stood.findings, task.twin) if task.may_move else NOT_ASKED
    done: list[Check] = []
    if stood.rest_state is not None and not why:
        stage = moving.move_cart(wire, task.twin, stood.rest_state, task.rate_hz)
        while True:
            try:
                finding = next(stage)
            except StopIteration as over:
                why = over.value
                break
            done.append(finding.check)
            yield finding
    for check in moving.CHECKS[len(done) :]:
        yield (
            _check_standing_rail(stood, task.twin)
            if check is Check.RAIL
            else skip_check(check, why)
        )


def _check_standing_rail(stood: Standing, twin: Twin) -> Finding:
    """Return whether a cart that was not moved stood on the rail."""
    zero = next(f for f in stood.findings if f.check is Check.CART_ZERO)
    if zero.verdict in (Verdict.FAIL, Verdict.SKIPPED):
        return skip_check(Check.RAIL, "see the cart's zero")
    cart = stood.samples[:, CART]
    return check_rail(float(cart.min()), float(cart.max()), twin.rig.rail_half_length_m)
