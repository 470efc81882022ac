"""The next experiment: it parts what is tied, narrows as promised, and keeps to the rail."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from support.hidden_physics import HIDDEN, record_hidden
from support.made_recordings import made_bag, without_joint
from support.tied_recordings import (
    INTECO,
    ROOM,
    fit_recordings,
    make_gentle_sweep,
    make_hidden_twin,
    record_plan,
    record_twin,
)

from pendulum_sysid import decisions
from pendulum_sysid.cli import main
from pendulum_sysid.finding.identifiability import find_ties
from pendulum_sysid.finding.separation import Tie
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.parameters import Free
from pendulum_sysid.planning.aims import Narrowing, forget_beliefs
from pendulum_sysid.planning.growing_plan import Setting
from pendulum_sysid.planning.next_experiment import plan_next_experiment
from pendulum_sysid.planning.next_sentences import describe_nothing_to_ask
from pendulum_sysid.records import Fit, Next, Split
from pendulum_twin.effects import CATALOGUE
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin, save_twin
from pendulum_twin.plans.plan_file import load_plan, parse_plan

Fitted = tuple[Case, Split, Fit]

SLOW = make_gentle_sweep(8, 0.05)
DELAY = make_hidden_twin({"input_delay": {"delay_s": 0.01}})
DRY = {"cart_coulomb_friction": {"level_n": 0.3}}
TIED = {
    "delay and lag": (DELAY, SLOW, {"input_delay", "motor_lag"}),
    "static and dry friction": (
        make_hidden_twin(
            {"cart_stribeck_friction": {"level_n": 0.3, "static_n": 1.15e-3, "velocity_m_s": 0.02}}
        ),
        SLOW,
        {"cart_stribeck_friction", "cart_coulomb_friction"},
    ),
}


@pytest.fixture(scope="module")
def delayed() -> Fitted:
    """Return a slow recording of a delay, fitted: a lag could stand in the delay's place."""
    return fit_recordings([record_twin(DELAY, SLOW)], DELAY)


@pytest.fixture(scope="module")
def ties(delayed: Fitted) -> tuple[Tie, ...]:
    return tuple(find_ties(*delayed))


def list_pairs(ties: Any) -> set[frozenset[str]]:
    return {
        frozenset((tie.effect, tie.rival)) for tie in ties if tie.rival and not tie.by_no_motion
    }


@pytest.mark.parametrize("case", TIED)
def test_after_the_plan_the_tie_is_gone(case: str) -> None:
    truth, command, pair = TIED[case]
    first = record_twin(truth, command)
    before = fit_recordings([first], truth)
    tied = find_ties(*before)
    assert frozenset(pair) in list_pairs(tied)
    planned = plan_next_experiment(*before, tied)
    assert planned.plan is not None and planned.before is not None and planned.after is not None
    assert planned.before < decisions.APART_STANDARD_ERRORS < planned.after
    assert all(name in planned.why for name in pair)
    second = record_plan(truth, planned.plan)
    assert second.signals.cart is not None
    assert np.max(np.abs(second.signals.cart)) <= 1.1 * decisions.RAIL_SHARE * ROOM.half_length_m
    assert frozenset(pair) not in list_pairs(find_ties(*fit_recordings([first, second], truth)))


def test_an_interval_shrinks_as_promised() -> None:
    """Within a factor of two: the promise is the fitted twin's, and a few windows scatter."""
    truth = make_hidden_twin(DRY)
    first = record_twin(truth, make_gentle_sweep(6, 0.06))
    case, parts, best = fit_recordings([first], truth)
    planned = plan_next_experiment(case, parts, best, (), "interval")
    assert planned.plan is not None and planned.after is not None and planned.before is not None
    name = planned.why.split()[0]
    estimate = best.estimates[name]
    assert planned.before == pytest.approx((estimate.high - estimate.low) / 2, rel=1e-6)
    assert planned.after < 0.5 * planned.before
    after = fit_recordings([first, record_plan(truth, planned.plan)], truth)[2].estimates[name]
    assert (after.high - after.low) / 2 == pytest.approx(planned.after, rel=1.0)
    assert (after.high - after.low) / 2 > 0.5 * planned.after


def test_a_tie_that_no_plan_parts_is_said_and_does_not_hold_up_the_others() -> None:
    """Friction that differs by direction is dry friction and a constant force, also at rest."""
    truth = make_hidden_twin(
        {**DRY, "rail_tilt": {"angle_rad": 0.005}, "input_delay": {"delay_s": 0.01}}
    )
    before = fit_recordings([record_twin(truth, SLOW)], truth)
    tied = find_ties(*before)
    hopeless = {"rail_tilt", "cart_friction_asymmetry"}
    assert {frozenset(hopeless), frozenset(("input_delay", "motor_lag"))} <= list_pairs(tied)
    planned = plan_next_experiment(*before, tied)
    assert planned.plan is not None and planned.after is not None
    assert planned.after > decisions.APART_STANDARD_ERRORS
    assert (
        "is expected to part rail_tilt and cart_friction_asymmetry" in planned.why
        and "input_delay and motor_lag" in planned.why
    )
    alone = plan_next_experiment(
        *before, [tie for tie in tied if {tie.effect, tie.rival} == hopeless], "tie"
    )
    assert alone.plan is None and "is expected to part" in alone.why


def test_what_no_plan_fixes_is_said_without_a_plan(
    delayed: Fitted, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a cart that follows its command as a speed, force and friction have only a ratio."""
    monkeypatch.setattr(Narrowing, "predict_half_width", lambda aim, normal: float("inf"))
    planned = plan_next_experiment(*delayed, (), "interval")
    assert planned.plan is None
    assert "no plan of 20 s that the rig allows fixes it" in planned.why
    assert "+-inf" not in planned.why


def test_a_constant_that_is_known_very_well_is_not_said_to_be_known_to_0(delayed: Fitted) -> None:
    best = delayed[2]
    sure = replace(best.estimates["force_per_pwm_n"], value=10.0, low=9.9997, high=10.0003)
    known = replace(best, estimates={"force_per_pwm_n": sure})
    assert "fixes force_per_pwm_n to 0.003% by itself" in describe_nothing_to_ask(known)


def test_what_no_motion_parts_is_said_with_what_would(
    delayed: Fitted, ties: tuple[Tie, ...]
) -> None:
    planned = plan_next_experiment(*delayed, ties)
    assert "No motion will part input_delay from sensor_delay; a second clock would" in planned.why
    assert all(effect.separated_by for effect in CATALOGUE if effect.shows_as is not None)


def test_nothing_is_planned_where_nothing_is_left_to_ask() -> None:
    recording, truth = record_hidden(
        {"cart_coulomb_friction": HIDDEN["cart_coulomb_friction"]}, seed=1, seconds=20.0
    )
    before = fit_recordings([recording], truth)
    tied = find_ties(*before)
    planned = plan_next_experiment(*before, tied)
    assert planned == Next(None, planned.why) and planned.why.startswith(
        "Nothing is tied that motion could part"
    )
    assert "cart_coulomb_friction.level_n to 0." in planned.why
    assert plan_next_experiment(*before, tied, "tie").plan is None
    assert plan_next_experiment(*before, tied, "interval").plan is not None


def test_the_same_question_gives_the_same_plan_and_its_length_is_what_was_asked_for(
    delayed: Fitted, ties: tuple[Tie, ...]
) -> None:
    first, again = (plan_next_experiment(*delayed, ties, seconds=9.0) for _ in range(2))
    assert first == again and first.plan is not None
    assert [phase["kind"] for phase in first.plan["phases"]][:: len(first.plan["phases"]) - 1] == [
        "push",
        "rest",
    ]
    assert parse_plan(first.plan).rate_hz == 100.0
    with pytest.raises(BadInputError, match="seconds: expected at least 5, found 3"):
        plan_next_experiment(*delayed, ties, seconds=3.0)


def test_a_locked_cart_gets_no_plan() -> None:
    recording, truth = record_hidden({}, seed=1, seconds=12.0)
    alone = without_joint(recording, "cart")
    before = fit_recordings([alone], truth)
    planned = plan_next_experiment(*before, (), "interval")
    assert planned.plan is None and planned.why.startswith("The cart is locked")


def test_a_rig_whose_rail_is_not_known_gets_no_plan(
    delayed: Fitted, ties: tuple[Tie, ...]
) -> None:
    case, parts, best = delayed
    case = replace(
        case, twin=replace(case.twin, rig=replace(case.twin.rig, rail_half_length_m=None))
    )
    planned = plan_next_experiment(case, parts, best, ties)
    assert (
        planned.plan is None
        and "No plan can be made: " in planned.why
        and "rail_half_length_m" in planned.why
    )


def test_where_every_phase_leads_off_the_rail_there_is_no_plan(
    delayed: Fitted, ties: tuple[Tie, ...]
) -> None:
    case, parts, best = delayed
    case = replace(
        case, twin=replace(case.twin, rig=replace(case.twin.rig, rail_half_length_m=0.005))
    )
    assert plan_next_experiment(case, parts, best, ties).why.startswith(
        "No phase of a plan keeps the cart"
    )


def files(folder: Path, twin: Twin, command: np.ndarray) -> list[str]:
    """Write a recording and the nominal twin; return the arguments that name them."""
    made_bag(folder / "bag", record_twin(twin, command))
    save_twin(INTECO, folder / "nominal.yaml")
    return [
        str(folder / "bag"),
        "--twin",
        str(folder / "nominal.yaml"),
        "--out",
        str(folder / "next.yaml"),
    ]


def test_the_command_goes_on_from_a_verdict(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = files(tmp_path, DELAY, SLOW)
    save_twin(DELAY, tmp_path / "twin.yaml")
    missing = [{"effect": "input_delay", "cannot_be_told_from": ["motor_lag"]}]
    verdict = {"schema": "pendulum_verdict/1", "outcome": "ambiguous", "missing_physics": missing}
    (tmp_path / "verdict.json").write_text(json.dumps(verdict))
    asked += ["--verdict", str(tmp_path / "verdict.json"), "--seconds", "12"]
    assert main(["next", *asked]) == 0
    said, progress = capsys.readouterr()
    assert "\nplanning the next experiment\n" in progress and "left: " not in progress
    assert "input_delay and motor_lag cannot be told apart" in said and said.endswith(
        f"{tmp_path / 'next.yaml'}\n"
    )
    assert load_plan(tmp_path / "next.yaml", ROOM).seconds == pytest.approx(12.0, abs=0.05)
    once = yaml.safe_load((tmp_path / "next.yaml").read_text())
    assert once["schema"] == "pendulum_plan/1"
    assert main(["next", *asked, "--repeat"]) == 0
    twice = yaml.safe_load((tmp_path / "next.yaml").read_text())
    middle = len(once["phases"])
    assert twice["phases"][middle]["kind"] == "rest"
    assert twice["phases"][:middle] == twice["phases"][middle + 1 :] == once["phases"]


def test_the_plan_is_for_what_the_verdict_does_not_know(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A diagnosis widens intervals; a fit of what it names knows nothing of that."""
    asked = files(tmp_path, DELAY, SLOW)
    save_twin(DELAY, tmp_path / "twin.yaml")
    delay = {"delay_s": {"value": 0.01, "low": 0.0, "high": 0.03, "unit": "s"}}
    missing = [{"effect": "input_delay", "cannot_be_told_from": [], "parameters": delay}]
    known = {"force_per_pwm_n": {"after": 12.0, "low": None, "high": None}}
    verdict = {
        "schema": "pendulum_verdict/1", "outcome": "named", "missing_physics": missing,
        "rig_parameters": known,
    }  # fmt: skip
    (tmp_path / "verdict.json").write_text(json.dumps(verdict))
    words = ["--verdict", str(tmp_path / "verdict.json"), "--seconds", "12", "--for", "interval"]
    assert main(["next", *asked, *words]) == 0
    assert "input_delay.delay_s is known to +-0.02 s" in capsys.readouterr().out


def test_a_constant_that_the_diagnosis_held_stays_known(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The fit of what a verdict names changed constants that `diagnose --hold` had kept."""
    asked = files(tmp_path, DELAY, SLOW)
    held = ["--hold", "pole_viscous_n_m_s", "--out", str(tmp_path / "told")]
    assert main(["--quiet", "diagnose", *asked[: asked.index("--out")], *held]) == 0
    capsys.readouterr()
    verdict = ["--verdict", str(tmp_path / "told" / "verdict.json")]
    assert main(["next", *asked, *verdict, "--seconds", "12", "--for", "interval"]) == 0
    assert "pole_viscous_n_m_s" not in capsys.readouterr().out


@pytest.mark.parametrize(
    ("text", "wrong"),
    [
        ("no json", "it cannot be read"),
        ("{}", "expected a verdict with schema pendulum_verdict/1"),
        (
            '{"schema": "pendulum_verdict/1", "outcome": "unusable", "missing_physics": []}',
            "on a usable recording",
        ),
        (
            '{"schema": "pendulum_verdict/1", "outcome": "named", "missing_physics": []}',
            "twin.yaml: expected a twin file",
        ),
    ],
)
def test_a_verdict_that_is_none_is_refused(
    text: str, wrong: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = files(tmp_path, DELAY, SLOW[:500])
    (tmp_path / "verdict.json").write_text(text)
    assert main(["next", *asked, "--verdict", str(tmp_path / "verdict.json")]) == 1
    assert wrong in capsys.readouterr().err and not (tmp_path / "next.yaml").exists()


def test_a_plan_too_short_is_refused_before_anything_is_read(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = ["no_bag", "--twin", "no.yaml", "--out", str(tmp_path / "next.yaml")]
    assert main(["next", *asked, "--seconds", "3"]) == 2
    assert "seconds: expected at least 5, found 3" in capsys.readouterr().err


def test_a_belief_is_no_data_of_a_planned_run() -> None:
    mass = Free("cart_mass_kg", "kg", (0,), (1.0,), 0.1, 2.0, 0.5, believed=0.6, spread=0.01)
    (forgotten,) = forget_beliefs((mass,))
    assert mass.belief == pytest.approx(2500.0) and forgotten.belief == 0.0
    assert replace(forgotten, spread=mass.spread) == mass


@pytest.mark.parametrize(
    ("column", "most"),
    [
        (0, decisions.RAIL_SHARE * ROOM.half_length_m),
        (2, decisions.PLAN_FASTEST_M_S),
        (3, decisions.PLAN_FASTEST_RAD_S),
    ],
    ids=["far", "fast", "spinning"],
)
def test_a_phase_is_safe_within_each_of_its_bounds_for_every_twin(
    column: int, most: float
) -> None:
    blank: dict[str, Any] = dict.fromkeys(Setting.__dataclass_fields__)
    setting = Setting(**{**blank, "room": ROOM})
    for share, safe in ((0.99, True), (1.01, False), (-1.01, False)):
        states = np.tile([0.0, 99.0, 0.0, 0.0], (2, 50, 1))  # however far the pole has turned
        states[1, 30, column] = share * most
        assert setting.is_safe(states) is safe
