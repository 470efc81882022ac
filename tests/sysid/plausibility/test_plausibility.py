"""A recording in other units, columns or zeros is refused before any search, with the option."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from support.made_recordings import (
    INTECO,
    PERIOD_S,
    made,
    made_states,
    sweep,
    without_joint,
)

from pendulum_sysid import pipeline
from pendulum_sysid.finding.stages import Stage
from pendulum_sysid.plausibility.answers import Check, CheckAnswer
from pendulum_sysid.plausibility.ask import check_plausibility
from pendulum_sysid.prepare import prepare_case
from pendulum_sysid.records import Outcome, Recording
from pendulum_twin.arrays import Floats
from pendulum_twin.model import Twin

Columns = dict[str, Floats]
Fault = Callable[[Columns], Columns]


@pytest.fixture(scope="module")
def columns() -> Columns:
    signals = made(INTECO).signals
    assert signals.cart is not None and signals.pole is not None
    times = np.arange(len(signals)) * PERIOD_S
    return {"t": times, "command": signals.command, "cart": signals.cart, "pole": signals.pole}


def record(columns: Columns) -> Recording:
    return Recording.from_arrays(**columns)


def check(recording: Recording, twin: Twin = INTECO) -> dict[str, Check]:
    return {c.question: c for c in check_plausibility(prepare_case([recording], twin))}


def scale(**factors: float) -> Fault:
    return lambda columns: {**columns, **{k: f * columns[k] for k, f in factors.items()}}


def shift_pole(angle: float) -> Fault:
    return lambda columns: {**columns, "pole": columns["pole"] + angle}


def exchange(columns: Columns) -> Columns:
    return {**columns, "cart": columns["pole"], "pole": columns["cart"]}


def wrap_degrees(columns: Columns) -> Columns:
    return {**columns, "pole": np.remainder(np.degrees(columns["pole"]), 360.0) - 180.0}


FAULTS = {
    "mm": (scale(cart=1e3), "rail's 1.8 m, found ", "--length-unit mm"),
    "cm": (scale(cart=1e2), "rail's 1.8 m, found ", "--length-unit cm"),
    "degrees": (scale(pole=180.0 / math.pi), "an angle in rad", "--angle-unit deg"),
    "wrapped degrees": (wrap_degrees, "an angle in rad", "--angle-unit deg"),
    "turns": (scale(pole=0.5 / math.pi), "an angle in rad", "--angle-unit turn"),
    "ms": (scale(t=1e3), "samples a second, found 0.1 ", "--time-unit ms"),
    "us": (scale(t=1e6), "samples a second, found 0.0001 ", "--time-unit us"),
    "exchanged": (exchange, "an angle in rad", "--cart and --pole are exchanged"),
    "percent": (scale(command=1e2), "pwm_limit of 0.5, found 10", "--command-unit percent"),
    "per mille": (scale(command=1e3), "pwm_limit of 0.5, found 100", "--command-unit per_mille"),
    "zero down": (shift_pole(-math.pi), "found a pole that hangs at ", "--pole-zero down"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_of_the_import_ends_as_unusable_with_the_option_that_mends_it(
    columns: Columns, name: str
) -> None:
    fault, found, advice = FAULTS[name]
    lines: list[str] = []
    verdict = pipeline.diagnose([record(fault(columns))], INTECO, lines.append)
    assert verdict.outcome is Outcome.UNUSABLE
    assert found in verdict.sentence
    assert advice in verdict.sentence
    assert ("in volts" in verdict.sentence) == (name in ("percent", "per mille"))
    assert lines == [Stage.PREPARING]  # nothing was searched


RIGHT = {
    "as it is": scale(),
    "cart's sign": scale(cart=-1.0),
    "angle's sign": scale(pole=-1.0),
    "command's sign": scale(command=-1.0),
    "position's scale": scale(cart=1.3),
    "clock": scale(t=1.1),
    "angle's offset": shift_pole(0.3),
    "whole turns": shift_pole(2.0 * math.pi),
}


@pytest.mark.parametrize("name", RIGHT)
def test_what_a_search_can_find_is_plausible(columns: Columns, name: str) -> None:
    answers = {c.answer for c in check(record(RIGHT[name](columns))).values()}
    assert answers == {CheckAnswer.YES}


@pytest.mark.parametrize("constant", ["cart_mass_kg", "force_per_pwm_n", "pole_inertia_kg_m2"])
@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_wrong_constants_stop_nothing(columns: Columns, constant: str, factor: float) -> None:
    rig = replace(INTECO.rig, **{constant: factor * getattr(INTECO.rig, constant)})
    answers = {c.answer for c in check(record(columns), replace(INTECO, rig=rig)).values()}
    assert CheckAnswer.NO not in answers


def test_a_twin_far_from_the_recording_is_doubted_but_not_refused(columns: Columns) -> None:
    rig = replace(INTECO.rig, force_per_pwm_n=10.0 * INTECO.rig.force_per_pwm_n)
    checks = check(record(columns), replace(INTECO, rig=rig))
    drive = checks["Is the drive about as strong as the twin's?"]
    assert drive.answer is CheckAnswer.DOUBT
    assert "force_per_pwm_n of the twin file" in drive.advice
    heavy = replace(INTECO.rig, pole_inertia_kg_m2=10.0 * INTECO.rig.pole_inertia_kg_m2)
    swing = check(record(columns), replace(INTECO, rig=heavy))[
        "Does the hanging pole swing at its own frequency?"
    ]
    assert swing.answer is CheckAnswer.DOUBT
    assert "pole_inertia_kg_m2" in swing.advice


def test_a_command_that_chatters_leaves_the_drive_its_strength() -> None:
    random = np.random.default_rng(0)
    command = sweep(30.0, 0.02) + 0.1 * random.choice([-1.0, 1.0], 3000)
    cart, pole = (made_states(INTECO, command)[:, :2] + random.normal(0.0, 5e-5, (3000, 2))).T
    chattering = {"t": np.arange(3000) * PERIOD_S, "command": command, "cart": cart, "pole": pole}
    drive = check(record(chattering))["Is the drive about as strong as the twin's?"]
    assert drive.answer is CheckAnswer.YES


def test_one_joint_alone_is_asked_what_it_can_answer(columns: Columns) -> None:
    cart = check(without_joint(record(columns), "pole"))
    assert {c.answer for c in cart.values()} == {CheckAnswer.YES}
    assert "Is the angle 0 upright?" not in cart
    pole = check(Recording.from_arrays(columns["t"], None, None, made_swing()))
    assert {c.answer for c in pole.values()} == {CheckAnswer.YES}
    assert "Is the angle 0 upright?" in pole
    down = check(Recording.from_arrays(columns["t"], None, None, made_swing() - math.pi))
    assert down["Is the angle 0 upright?"].answer is CheckAnswer.NO


def made_swing() -> Floats:
    """Make a free swing of INTECO's pole, its cart locked: 20 s from 1 rad beside hanging."""
    rig = INTECO.rig
    assert rig.com_distance_m is not None and rig.pole_inertia_kg_m2 is not None
    k = rig.total_mass_kg * rig.com_distance_m * rig.gravity_m_s2 / rig.pole_inertia_kg_m2
    step, angle, rate, angles = PERIOD_S / 20, math.pi + 1.0, 0.0, []
    for sample in range(2000 * 20):
        rate += step * k * math.sin(angle)
        angle += step * rate
        if sample % 20 == 0:
            angles.append(angle)
    return np.array(angles) + np.random.default_rng(0).normal(0.0, 1e-3, 2000)


def test_noise_alone_convicts_nothing(columns: Columns) -> None:
    rng = np.random.default_rng(1)
    still = {
        "t": columns["t"],
        "command": columns["command"],
        "cart": rng.normal(0.0, 1e-4, len(columns["t"])),
        "pole": math.pi + rng.normal(0.0, 1e-3, len(columns["t"])),
    }
    assert CheckAnswer.NO not in {c.answer for c in check(record(still)).values()}


def test_a_pole_that_rests_upright_without_a_command_is_doubted(columns: Columns) -> None:
    rng = np.random.default_rng(2)
    quiet = {
        "t": columns["t"],
        "command": np.zeros(len(columns["t"])),
        "cart": np.zeros(len(columns["t"])) + rng.normal(0.0, 1e-5, len(columns["t"])),
        "pole": rng.normal(0.0, 1e-5, len(columns["t"])),
    }
    zero = check(record(quiet))["Is the angle 0 upright?"]
    assert zero.answer is CheckAnswer.DOUBT
    assert zero.sentence.endswith(
        "import the file with --pole-zero down (with up, if it was imported with down)"
    )
