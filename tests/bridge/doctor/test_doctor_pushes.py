"""While it is driven the cart stays near, is stopped, and gets no larger command than needed."""

import math
from collections.abc import Generator
from dataclasses import replace
from itertools import pairwise
from unittest.mock import MagicMock

import pytest
from support.doctor_bench import TWIN, Bench

from pendulum_bridge.doctor.driving import BRAKED, LAST_PACKETS, SILENT, play_plan, stop
from pendulum_bridge.doctor.moving import move_cart
from pendulum_bridge.doctor.pushes import (
    Doublet,
    Homing,
    Moment,
    Nudged,
    Plan,
    plan_homing,
    plan_nudge,
    plan_pushes,
    plan_reset_watch,
)
from pendulum_bridge.doctor.resting import AtRest
from pendulum_bridge.doctor.wire import PortWire
from pendulum_bridge.safety.rig_state import RigState
from pendulum_bridge.safety.state import make_rules
from pendulum_bridge.wire.protocol import Command, Sample
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin

RULES = make_rules(TWIN.rig)
HOMING = Homing(1, 1 / 18.6, 0.0)


def hold(pwm: float, seconds: float) -> Plan[str]:
    moment = yield 0.0
    while moment.elapsed_s < seconds:
        moment = yield pwm
    return "held"


def states(*carts: float, pole_rad: float = math.pi) -> Generator[Moment, None, None]:
    """Yield moments 10 ms apart with these cart positions, the last for ever."""
    k = 0
    while True:
        yield Moment(0.01 * k, RigState(carts[min(k, len(carts) - 1)], pole_rad, 0.0, 0.0))
        k += 1


def fed(plan: Plan[Nudged], moments: Generator[Moment, None, None]) -> tuple[Nudged, list[float]]:
    """Return what a plan has seen in these moments, and what it asked for."""
    commands = [next(plan)]
    while True:
        try:
            commands.append(plan.send(next(moments)))
        except StopIteration as over:
            return over.value, commands


def test_a_rig_in_volts_is_not_pushed() -> None:
    volts = replace(TWIN, rig=replace(TWIN.rig, pwm_limit=24.0))
    rest_state = AtRest(math.pi, 0.0, 0.0, 0.0, wrapped=False)
    with pytest.raises(StopIteration, match="pwm_limit: expected at most 1"):
        next(move_cart(MagicMock(), volts, rest_state, 100.0))


def test_a_cart_that_stands_is_pushed_no_harder_than_allowed() -> None:
    seen, commands = fed(plan_nudge(0.4, 0.1), states(0.02))
    assert seen == Nudged(None, None, 0)
    assert max(commands) == pytest.approx(0.4, abs=0.002) and min(commands) == 0.0
    assert max(abs(b - a) for a, b in pairwise(commands)) < 0.0015


def test_one_wrong_sample_does_not_move_the_cart() -> None:
    seen, commands = fed(plan_nudge(0.1, 0.1), states(0.0, 0.0, 0.0, 0.05, 0.0))
    assert (seen.way, max(commands)) == (0, pytest.approx(0.1, abs=0.002))


def test_a_pole_that_swings_over_a_standing_cart_ends_the_push() -> None:
    def swinging() -> Generator[Moment, None, None]:
        for moment in states(0.0):
            angle = math.pi + (0.3 if moment.elapsed_s > 0.2 else 0.0)
            yield Moment(moment.elapsed_s, RigState(0.0, angle, 0.0, 0.0))

    seen, commands = fed(plan_nudge(0.4, 0.1), swinging())
    assert seen.blind and max(commands) < 0.03


@pytest.mark.parametrize("effects", [{}, {"input_sign_inverted": {}}])
def test_a_cart_that_nobody_sees_is_stopped_again(effects: dict) -> None:
    def stuck(sample: Sample) -> bytes:
        return replace(sample, cart_m=0.0, cart_velocity=0.0).pack()

    bench = Bench(Twin("rig", TWIN.rig, effects), stuck)
    driven = play_plan(bench, plan_nudge(0.4, 0.1), RULES, signs_known=False)
    assert driven.seen is not None and driven.seen.blind
    play_plan(bench, hold(0.0, 3.0), RULES)
    assert bench.furthest_m < 0.06


def test_a_cart_that_runs_away_ends_the_push() -> None:
    seen, commands = fed(plan_nudge(0.4, 0.1), states(*(0.002 * k for k in range(1000))))
    assert (seen.way, seen.back) == (1, None) and max(map(abs, commands)) < 0.1


@pytest.mark.parametrize("way", [1, -1])
def test_the_first_push_tells_the_way(way: int) -> None:
    bench = Bench(Twin("rig", TWIN.rig, {} if way > 0 else {"input_sign_inverted": {}}))
    driven = play_plan(bench, plan_nudge(0.4, 0.1), RULES, signs_known=False)
    assert driven.seen is not None and driven.seen.way == way
    assert driven.seen.forth is not None and 0 < driven.seen.forth < 0.05
    assert driven.seen.back is not None and -0.08 < driven.seen.back < 0
    assert bench.furthest_m < 0.06


def test_home_and_doublets_leave_the_cart_where_they_should() -> None:
    bench = Bench()
    play_plan(bench, plan_homing(0.1, HOMING), RULES)
    assert bench.rig.sample.cart_m == pytest.approx(0.1, abs=0.035)
    driven = play_plan(
        bench, plan_pushes((Doublet(0.06, 0.12), Doublet(0.5, 0.06)), HOMING), RULES
    )
    assert bench.rig.sample.cart_m == pytest.approx(0.0, abs=0.035)
    assert (driven.track.sent.max(), driven.track.sent.min()) == (0.5, -0.5)
    assert len(driven.track.arrivals) == len(driven.track.samples)


def test_the_end_of_every_drive_is_pwm_0() -> None:
    bench = Bench()
    assert play_plan(bench, hold(0.1, 0.2), RULES, reset=True).seen == "held"
    assert bench.sent[-LAST_PACKETS:] == [Command(0.0)] * LAST_PACKETS
    assert bench.sent[5] == Command(0.1, reset=True)


def test_a_silent_rig_gets_pwm_0_and_ends_the_drive() -> None:
    bench = Bench()
    bench.silent_from_s = 0.3
    driven = play_plan(bench, hold(0.05, 5.0), RULES)
    assert (driven.seen, driven.broken_off) == (None, SILENT)
    silent = [command.pwm for command in bench.sent[-20:]]
    assert silent[0] == 0.0 and bench.pwm == 0.0 and bench.now() < 1.0
    assert min(command.pwm for command in bench.sent) == 0.0, "it braked a cart that nobody saw"


@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError])
def test_whatever_interrupts_a_drive_pwm_0_is_sent(error: type[BaseException]) -> None:
    bench = Bench()
    receive, count = bench.receive, iter(range(1000))

    def interrupted(deadline: float) -> object:
        if next(count) == 20:
            raise error
        return receive(deadline)

    bench.receive = interrupted  # type: ignore[method-assign, assignment]
    with pytest.raises(error):
        play_plan(bench, hold(0.1, 5.0), RULES)
    assert any(command.pwm == 0.1 for command in bench.sent)
    assert bench.sent[-LAST_PACKETS:] == [Command(0.0)] * LAST_PACKETS


def test_the_rail_guard_ends_a_drive_and_brakes_first() -> None:
    bench = Bench()
    driven = play_plan(bench, hold(0.3, 5.0), RULES)
    assert driven.broken_off == BRAKED and driven.seen is None
    assert min(command.pwm for command in bench.sent) < -0.2, "the guard's brake was not sent"
    assert bench.furthest_m < RULES.guard.end_m and abs(bench.rig.sample.cart_velocity) < 0.1


def test_where_signs_are_not_known_the_guards_brake_is_not_sent() -> None:
    bench = Bench(Twin("rig", TWIN.rig, {"input_sign_inverted": {}}))
    driven = play_plan(bench, hold(0.1, 9.0), RULES, signs_known=False)
    assert driven.broken_off == BRAKED
    assert {round(command.pwm, 9) for command in bench.sent} == {0.0, 0.1}


def test_the_rigs_own_swing_down_is_seen() -> None:
    bench = Bench()
    play_plan(bench, plan_homing(0.1, HOMING), RULES)
    seen = play_plan(bench, plan_reset_watch(math.pi, 20.0, 3.0), RULES, reset=True).seen
    assert seen is not None and seen.moved and seen.rest_s is not None and 0.5 < seen.rest_s < 10.0


def test_old_samples_of_a_standstill_are_not_answered() -> None:
    """After a pause all waiting samples are kept for the track; only the newest is decided on."""
    bench = Bench(shown=Sample.pack)
    receive = bench.receive

    def late(deadline: float) -> object:
        heard = receive(deadline)
        if heard is not None and 0.1 < heard.at_s < 0.2:
            return type(heard)(heard.packet, heard.at_s - 0.05)
        return heard

    bench.receive = late  # type: ignore[method-assign, assignment]
    driven = play_plan(bench, hold(0.05, 0.3), RULES)
    assert len(driven.track.samples) - len(driven.track.sent) >= 8


def test_stop_says_it_more_than_once() -> None:
    bench = Bench()
    stop(bench)
    assert bench.sent == [Command(0.0)] * LAST_PACKETS and LAST_PACKETS > 1


@pytest.mark.parametrize("refused", [1, LAST_PACKETS - 1, LAST_PACKETS])
def test_stop_tries_every_packet(refused: int) -> None:
    """A port that refuses for a while; closed without a PWM 0, the wire says so."""
    out: list[bytes] = []
    port = MagicMock(send=out.append)
    wire = PortWire(port)
    wire.send(Command(0.2))
    answers = iter([BadInputError("Network is unreachable")] * refused + [None] * LAST_PACKETS)

    def send(packet: bytes) -> None:
        if answer := next(answers):
            raise answer
        out.append(packet)

    port.send = send
    if refused < LAST_PACKETS:
        stop(wire)
        wire.close()
        assert out == [Command(0.2).pack()] + [Command(0.0).pack()] * (LAST_PACKETS - refused)
        return
    with pytest.raises(BadInputError, match="Network is unreachable"):
        stop(wire)
    with pytest.raises(BadInputError, match=r"the rig may hold PWM 0\.2: switch it off"):
        wire.close()
