"""Examinations of emulated rigs (MuJoCo) with a fault each: the finding names it alone."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import pytest
from support.doctor_bench import TWIN, Bench, Shown, faults, lines

from pendulum_bridge.doctor.examination import NOT_ASKED, Task, examine
from pendulum_bridge.doctor.faults import Fault, Verdict
from pendulum_bridge.doctor.findings import Check, Finding
from pendulum_bridge.doctor.moving import CHECKS
from pendulum_bridge.emulator.sensors import Encoders
from pendulum_bridge.wire.protocol import Command, Sample
from pendulum_twin.model import Twin

TASK = Task(TWIN, listen_s=0.5, may_move=True)
NEAR_M = 0.25  # from the middle: further no examination may take the cart


@dataclass(frozen=True)
class Case:
    """One rig, as it truly is; see Bench."""

    name: str
    expected: set[Fault]
    effects: dict | None = None
    force_n: float = 12.86
    shown: Shown = Sample.pack
    obeys: Callable[[Command], Command] = lambda command: command


def examined(bench: Bench, task: Task = TASK) -> list[Finding]:
    findings = list(examine(bench, task))
    assert [finding.check for finding in findings] == list(Check)[
        list(Check).index(Check.SAMPLES) :
    ]
    if task.may_move and any(command.pwm for command in bench.sent):
        assert bench.sent[-1] == Command(0.0)
    assert bench.furthest_m < NEAR_M
    return findings


def first(check: Check, findings: list[Finding]) -> Finding:
    return next(finding for finding in findings if finding.check is check)


def stuck_cart(sample: Sample) -> bytes:
    return replace(sample, cart_m=0.01, cart_velocity=0.0).pack()


def stuck_pole(sample: Sample) -> bytes:
    return replace(sample, pole_rad=math.pi, pole_rate=0.0).pack()


def positions_first(sample: Sample) -> bytes:
    return Sample(sample.pole_rad, sample.cart_m, sample.pole_rate, sample.cart_velocity).pack()


def wrapped(sample: Sample) -> bytes:
    return replace(sample, pole_rad=math.remainder(sample.pole_rad - 1e-9, math.tau)).pack()


def jumping(sample: Sample) -> bytes:
    return replace(sample, cart_m=sample.cart_m + (0.3 if sample.cart_m > 0.003 else 0.0)).pack()


def mirrored_velocity(sample: Sample) -> bytes:
    return replace(sample, cart_velocity=-sample.cart_velocity).pack()


CASES = [
    Case("command mirrored", {Fault.COMMAND_MIRRORED}, {"input_sign_inverted": {}}),
    Case("angle mirrored", {Fault.ANGLE_MIRRORED}, {"angle_sign_inverted": {}}),
    Case("mirrored, sticky", {Fault.CART_MIRRORED},
         {"cart_sign_inverted": {}, "cart_coulomb_friction": {"level_n": 0.8}}),
    Case("motor off", {Fault.CART_STANDS}, obeys=lambda command: Command(0.0, command.reset)),
    Case("stiff", {Fault.STIFF}, {"cart_coulomb_friction": {"level_n": 3.0}}),
    Case("cart's encoder stuck", {Fault.CART_BLIND}, shown=stuck_cart),
    Case("pole's encoder stuck", {Fault.POLE_STANDS}, shown=stuck_pole),
    Case("positions first", {Fault.FIELDS_MIXED}, shown=positions_first),
    Case("angle wrapped", {Fault.WRAPPED}, shown=wrapped),
    Case("cart's encoder jumps", {Fault.JUMPED}, shown=jumping),
    Case("velocity mirrored", {Fault.VELOCITY_WRONG}, shown=mirrored_velocity),
    Case("far stronger", {Fault.GAIN_UNSAFE}, force_n=2.2 * 12.86),
    Case("clipped", {Fault.CLIPPED}, {"input_saturation": {"limit": 0.3}}),
    Case("reset flag ignored", {Fault.RESET_IGNORED}, obeys=lambda command: Command(command.pwm)),
]  # fmt: skip


@pytest.mark.parametrize("case", CASES, ids=[case.name for case in CASES])
def test_each_fault_gives_its_finding_and_no_other(case: Case) -> None:
    rig = replace(TWIN.rig, force_per_pwm_n=case.force_n)
    findings = examined(Bench(Twin("rig", rig, case.effects or {}), case.shown, case.obeys))
    assert faults(findings) == case.expected, lines(findings)


@pytest.mark.parametrize("effects", [
    {}, {"cart_coulomb_friction": {"level_n": 1.0}, "input_dead_zone": {"width": 0.03}}],
                         ids=["smooth", "sticky"])  # fmt: skip
def test_a_good_rig_is_ok_in_every_line(effects: dict) -> None:
    bench = Bench(Twin("rig", TWIN.rig, effects))
    findings = examined(bench)
    assert {finding.verdict for finding in findings} == {Verdict.OK}, lines(findings)
    assert max(abs(command.pwm) for command in bench.sent) <= 0.5


def test_a_rig_that_is_wired_as_its_twin_file_says_is_ok() -> None:
    twin = Twin("mirrored", TWIN.rig, {"cart_sign_inverted": {}})
    findings = examined(Bench(twin), replace(TASK, twin=twin))
    assert not faults(findings), lines(findings)


def test_without_consent_nothing_is_sent() -> None:
    bench = Bench()
    findings = examined(bench, replace(TASK, may_move=False))
    assert bench.sent == []
    assert not faults(findings)
    assert [finding.check for finding in findings if finding.observed == NOT_ASKED] == [
        c for c in CHECKS if c is not Check.RAIL
    ]
    assert first(Check.RAIL, findings).verdict is Verdict.OK


@pytest.mark.parametrize(
    ("bench", "task", "words"),
    [
        (Bench(encoders=Encoders(spike_rate=0.2)), TASK, "not before 'rest, noise' is mended"),
        (
            Bench(Twin("rig", TWIN.rig, {"rail_tilt": {"angle_rad": 0.02}})),
            TASK,
            "not before 'rest, stands still' is mended",
        ),
        (Bench(rate_hz=50.0), TASK, "not before 'rate, rate' is mended"),
        (
            Bench(shown=lambda s: replace(s, cart_m=s.cart_m + 0.6).pack()),
            TASK,
            "not with the cart at 0.60 m",
        ),
        (
            Bench(),
            replace(TASK, twin=Twin("short", replace(TWIN.rig, rail_half_length_m=None))),
            "rail_half_length_m",
        ),
    ],
)
def test_a_rig_that_should_not_be_moved_is_not_moved(bench: Bench, task: Task, words: str) -> None:
    findings = examined_anywhere(bench, task)
    moves = first(Check.MOVES, findings)
    assert moves.verdict is Verdict.SKIPPED and words in moves.observed
    assert not any(command.pwm for command in bench.sent)


def examined_anywhere(bench: Bench, task: Task) -> list[Finding]:
    return list(examine(bench, task))


def test_a_rig_that_falls_silent_while_it_is_pushed_gets_pwm_0() -> None:
    bench = Bench()
    bench.silent_from_s = 0.75
    findings = examined(bench)
    assert faults(findings) == {Fault.FELL_SILENT}
    assert first(Check.MOVES, findings).fault is Fault.FELL_SILENT
    assert {finding.verdict for finding in findings[-3:]} == {Verdict.SKIPPED, Verdict.OK}
    assert bench.pwm == 0.0 and bench.now() < 2.0
