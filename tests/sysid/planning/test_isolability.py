"""What a plan will show: sizes that a fit finds, effects that stay tied, and what is refused."""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from support.tied_recordings import INTECO, ROOM, fit_recordings, record_plan

from pendulum_sysid.cli import main
from pendulum_sysid.planning.isolability import (
    Encoders,
    Isolability,
    _make_row,
    predict_isolability,
)
from pendulum_sysid.planning.planned_run import make_hanging_lanes, play_plans
from pendulum_twin.effects import BY_NAME, CATALOGUE
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin, save_twin
from pendulum_twin.parameter_vector import make_theta
from pendulum_twin.plans.excitation import Excitation
from pendulum_twin.plans.plan_file import Plan, make_excitation, save_plan
from pendulum_twin.plans.plan_phases import Chirp, Push, Rest
from pendulum_twin.stepper import Stepper

SLOW = Plan(
    (
        Push(),
        Chirp(seconds=12.0, from_hz=0.4, to_hz=0.6, amplitude=0.02),
        Rest(seconds=2.0, centred=True),
    )
)


def slow() -> Excitation:
    return make_excitation(SLOW, ROOM)


ASKED = (
    "input_delay", "motor_lag", "cart_coulomb_friction", "cart_friction_asymmetry",
    "cart_quadratic_drag", "rail_tilt", "pole_quadratic_drag", "angle_offset",
    "cart_sign_inverted", "velocity_filter",
)  # fmt: skip


@pytest.fixture(scope="module")
def progress() -> list[str]:
    """Return the lines of progress, once the isolability is predicted."""
    return []


@pytest.fixture(scope="module")
def isolability(progress: list[str]) -> Isolability:
    return predict_isolability(INTECO, slow(), Encoders(), ASKED, progress.append)


def test_each_effect_is_reported_as_its_turn_comes(
    isolability: Isolability, progress: list[str]
) -> None:
    """The whole catalogue takes a minute of CPU."""
    names = [row.effect for row in isolability.rows]
    assert len(names) == len(ASKED) - 1  # this rig reports no velocities to filter
    steps = [f"what looks like {name} ({k} of 9)" for k, name in enumerate(names, 1)]
    assert progress[-9:] == steps


@pytest.mark.parametrize(
    ("name", "parameter"),
    [
        ("cart_coulomb_friction", "level_n"),
        ("rail_tilt", "angle_rad"),
        ("cart_quadratic_drag", "n_s2_m2"),
    ],
)
def test_at_the_size_predicted_a_fit_finds_the_effect_so_many_errors_from_nothing(
    isolability: Isolability, name: str, parameter: str
) -> None:
    """On half of the windows instead of three quarters, 5 standard errors are 4.1."""
    (row,) = (row for row in isolability.rows if row.effect == name)
    assert row.found_from is not None and row.found_from < row.named_from < row.typical[parameter]  # type: ignore[operator]
    truth = Twin("hidden", INTECO.rig, {name: {parameter: row.found_from}})
    errors, widths = [], []
    for seed in range(4):
        estimate = fit_recordings([record_plan(truth, SLOW.to_mapping(), seed)], truth)[
            2
        ].estimates[f"{name}.{parameter}"]
        errors.append((estimate.value - row.found_from) / row.found_from)
        widths.append((estimate.high - estimate.low) / 2 / row.found_from)
    expected = 1 / 5 * np.sqrt(0.75 / 0.5)
    assert np.sqrt(np.mean(np.square(errors))) == pytest.approx(expected, rel=0.9)
    assert np.median(widths) == pytest.approx(
        2.2 * expected, rel=0.6
    )  # 2.2: few windows, by Student's t


def test_a_slow_plan_will_not_part_delay_from_lag_and_one_with_steps_will(
    isolability: Isolability,
) -> None:
    names = ("input_delay", "motor_lag")
    sweep = Chirp(seconds=12.0, from_hz=0.3, to_hz=0.5, amplitude=0.01, centred=False)
    slow_rows = predict_isolability(
        INTECO, make_excitation(Plan((sweep,)), ROOM), Encoders(), names
    ).rows
    assert [row.not_told_from for row in slow_rows] == [("motor_lag",), ("input_delay",)]
    assert [row.by_no_motion for row in slow_rows] == [("sensor_delay",), ()]
    rows = [row for row in isolability.rows if row.effect in names]  # its push has steps
    assert [row.not_told_from for row in rows] == [(), ()]


def test_every_effect_that_shows_in_positions_stands_once(isolability: Isolability) -> None:
    assert [row.effect for row in isolability.rows] == [
        e.name for e in CATALOGUE if e.name in set(ASKED) - {"velocity_filter"}
    ]
    (beside_dry_friction,) = (
        row for row in isolability.rows if row.effect == "cart_friction_asymmetry"
    )
    assert beside_dry_friction.found_from is None and beside_dry_friction.errors == pytest.approx(
        0.0, abs=1e-6
    )


def test_a_twin_s_own_effects_are_taken_for_granted() -> None:
    dry = replace(INTECO, effects={"cart_coulomb_friction": {"level_n": 0.3}})
    isolability = predict_isolability(
        dry, slow(), Encoders(), ("cart_coulomb_friction", "cart_friction_asymmetry")
    )
    rows = {row.effect: row for row in isolability.rows}
    assert "cart_coulomb_friction" not in rows and rows["cart_friction_asymmetry"].errors > 5
    assert "cart_coulomb_friction.level_n" in [row.name for row in isolability.constants]


def test_a_coarser_encoder_finds_less(isolability: Isolability) -> None:
    coarse = {
        row.effect: row
        for row in predict_isolability(
            INTECO, slow(), Encoders(pole_counts=256), ("pole_quadratic_drag", "angle_offset")
        ).rows
    }
    fine = {row.effect: row for row in isolability.rows}
    assert coarse["pole_quadratic_drag"].errors < 0.5 * fine["pole_quadratic_drag"].errors
    assert coarse["angle_offset"].found_from >= np.pi / 256  # type: ignore[operator]


def test_constants_that_a_plan_does_not_move_are_not_identifiable() -> None:
    still = make_excitation(Plan((Rest(seconds=6.0),)), ROOM)
    assert not any(
        row.identifiable
        for row in predict_isolability(INTECO, still, Encoders(), ("rail_tilt",)).constants
    )


@pytest.mark.parametrize(("errors", "rivals"), [(4.9, ()), (5.1, ("drive_offset",))])
def test_of_an_effect_that_does_not_show_no_rivals_are_told(
    errors: float, rivals: tuple[str, ...]
) -> None:
    """What stands out of no noise is told from nothing."""
    shape = SimpleNamespace(effect=BY_NAME["rail_tilt"], whole=make_theta(INTECO))
    row = _make_row(errors, shape, None, None, ("drive_offset",), Encoders(), ())  # type: ignore[arg-type]
    assert row.not_told_from == rivals


def test_a_plan_that_leads_off_the_rail_is_refused() -> None:
    short = replace(INTECO, rig=replace(INTECO.rig, rail_half_length_m=0.05))
    with pytest.raises(BadInputError, match="within the rail of"):
        predict_isolability(short, slow(), Encoders(), ())


def test_lanes_give_the_bits_of_a_stepper() -> None:
    effects = {"input_delay": {"delay_s": 0.02}, "cart_coulomb_friction": {"level_n": 0.5}}
    others = {
        "angle_offset": {"angle_rad": 0.02},
        "sample_period_error": {"ratio": 0.01},
        "gain_drift": {"per_s": 0.01},
    }
    twins = [Twin("one", INTECO.rig, effects), Twin("other", INTECO.rig, others)]
    theta, plan = np.array([make_theta(twin) for twin in twins]), slow()
    first = play_plans(make_hanging_lanes(theta, 0.01), [plan, plan], 400)
    second = play_plans(first.lanes.pick(np.array([1, 0])), [plan, plan], 100)
    for lane, twin in enumerate(twins):
        stepper = Stepper(twin, 0.01)
        commands = np.concatenate([first.commands[lane], second.commands[1 - lane]])
        states = np.array([stepper.state, *(stepper.step(u) for u in commands)])[:-1]
        assert np.array_equal(
            states, np.concatenate([first.states[lane], second.states[1 - lane]])
        )


def test_the_command_prints_a_table_and_json(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    isolability: Isolability,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    calls = []

    def predict(*arguments, report) -> Isolability:
        report("what looks like rail_tilt")
        calls.append(arguments)
        return isolability

    monkeypatch.setattr("pendulum_sysid.planning.isolability.predict_isolability", predict)
    save_twin(INTECO, tmp_path / "twin.yaml")
    save_plan(SLOW, tmp_path / "plan.yaml")
    arguments = [
        "effects",
        "--isolability",
        "--twin",
        str(tmp_path / "twin.yaml"),
        "--plan",
        str(tmp_path / "plan.yaml"),
    ]
    assert main(arguments) == 0
    said, progress = capsys.readouterr()
    assert "what looks like rail_tilt" in progress
    assert (
        "named from" in said
        and "sensor_delay (by no motion)" in said
        and "on or off" in said
        and "force_per_pwm_n" in said
    )
    assert max(map(len, said.splitlines())) <= 130
    assert main([*arguments[:-1], "standard", "--json", "--pole-counts", "1024"]) == 0
    content = json.loads(capsys.readouterr().out)
    assert content["schema"] == "pendulum_isolability/1" and {
        row["effect"] for row in content["rows"]
    } >= {"rail_tilt"}
    assert [plan.seconds for _, plan, _ in calls] == [15.5, 60.0]
    assert [encoders.pole_counts for _, _, encoders in calls] == [4096, 1024]


@pytest.mark.parametrize(
    "options", [["--isolability"], ["--plan", "standard"], ["--isolability", "--cart-step-m", "0"]]
)
def test_options_that_do_not_go_together_are_wrong_use(
    options: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["effects", *options])
    assert ended.value.code == 2 and "isolability" in capsys.readouterr().err
