"""A case: a twin cut down to what was recorded, and the pole by itself on its moving axis."""

from dataclasses import replace

import numpy as np
import pytest
from support.made_recordings import INTECO, made, without_joint

from pendulum_sysid.finding.pole_alone import put_pole_on_moving_axis
from pendulum_sysid.fitting.window_runs import WindowRuns, run_windows
from pendulum_sysid.fitting.windows import WINDOW_S, cut_windows
from pendulum_sysid.prepare import prepare_case
from pendulum_twin.errors import BadInputError
from pendulum_twin.laws.law import Law
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import make_theta
from pendulum_twin.rig import CART_KEYS, POLE_KEYS, Rig

EVERYWHERE = {
    "input_delay": {"delay_s": 0.01},
    "motor_lag": {"time_constant_s": 0.02},
    "cart_coulomb_friction": {"level_n": 0.3},
    "pole_quadratic_drag": {"n_m_s2": 1e-5},
    "angle_offset": {"angle_rad": 0.01},
}
FULL = replace(INTECO, effects=EVERYWHERE)


def test_both_joints_recorded_leave_the_twin_as_it_is() -> None:
    assert prepare_case([made(INTECO, 5.0)], FULL).twin == FULL


def test_a_pole_alone_keeps_mass_and_first_moment() -> None:
    twin = prepare_case([without_joint(made(INTECO, 5.0), "cart")], FULL).twin
    assert all(getattr(twin.rig, key) is None for key in CART_KEYS)
    assert twin.rig.total_mass_kg == INTECO.rig.pole_mass_kg
    moment = INTECO.rig.total_mass_kg * INTECO.rig.com_distance_m
    assert twin.rig.total_mass_kg * twin.rig.com_distance_m == pytest.approx(moment, rel=1e-12)
    assert twin.rig.pole_inertia_kg_m2 == INTECO.rig.pole_inertia_kg_m2
    assert set(twin.effects) == {"pole_quadratic_drag", "angle_offset"}


def test_a_cart_alone_keeps_the_mass_that_moves() -> None:
    twin = prepare_case([without_joint(made(INTECO, 5.0), "pole")], FULL).twin
    assert all(getattr(twin.rig, key) is None for key in POLE_KEYS)
    assert twin.rig.total_mass_kg == pytest.approx(INTECO.rig.total_mass_kg, rel=1e-12)
    assert {"input_delay", "motor_lag", "cart_coulomb_friction"} <= set(twin.effects)
    assert "pole_quadratic_drag" not in twin.effects


@pytest.mark.parametrize(("joint", "keys"), [("cart", POLE_KEYS), ("pole", CART_KEYS)])
def test_a_joint_that_the_twin_lacks_is_refused(joint: str, keys: tuple[str, ...]) -> None:
    alone = Twin("half", Rig(**{key: getattr(INTECO.rig, key) for key in keys}))
    with pytest.raises(
        BadInputError,
        match=f"^expected a twin with a {joint}, .* found none: give the twin file's keys",
    ):
        prepare_case([made(INTECO, 5.0)], alone)


# The pole on its moving axis


def runs_of_pole(truth: Twin, believed: Twin, noise: float = 0.0) -> tuple[WindowRuns, WindowRuns]:
    """Return free runs of a twin on a recording of another: of the rig, and of the pole alone."""
    case = prepare_case([made(truth, 10.0, 0.3, noise=noise)], believed)
    alone = put_pole_on_moving_axis(case, make_theta(believed))
    assert alone is not None and alone.signals.cart is None
    return tuple(
        run_windows(one, cut_windows(one.signals, one.state, WINDOW_S)) for one in (case, alone)
    )


def test_the_pole_by_itself_moves_as_it_did() -> None:
    _, alone = runs_of_pole(INTECO, INTECO)
    assert np.ptp(alone.measured) > 1.0
    assert alone.rmse[0] < 2e-3


@pytest.mark.parametrize(
    "effects",
    [
        {"cart_coulomb_friction": {"level_n": 0.8}},
        {"input_delay": {"delay_s": 0.04}},
        {"rail_spring": {"n_per_m": 3.0, "centre_m": 0.1}},
    ],
    ids=lambda effects: next(iter(effects)),
)
def test_what_the_cart_s_model_lacks_does_not_reach_it(effects: dict) -> None:
    both, alone = runs_of_pole(replace(INTECO, effects=effects), INTECO)
    assert both.of_joint(1, both.rmse) > 0.03
    assert alone.rmse[0] < 0.1 * both.of_joint(1, both.rmse)


def test_what_the_pole_s_model_lacks_does() -> None:
    drag = replace(INTECO, effects={"pole_coulomb_friction": {"level_n_m": 0.002}})
    _, alone = runs_of_pole(drag, INTECO)
    assert alone.rmse[0] > 0.02


def test_a_cart_counted_the_wrong_way_round_moves_the_axis_the_right_way() -> None:
    mirrored = replace(INTECO, effects={"cart_sign_inverted": {}})
    _, right = runs_of_pole(mirrored, mirrored)
    _, wrong = runs_of_pole(mirrored, INTECO)
    assert right.rmse[0] < 2e-3 < 0.1 < wrong.rmse[0]


@pytest.mark.parametrize("joint", ["cart", "pole"])
def test_one_joint_has_no_moving_axis(joint: str) -> None:
    case = prepare_case([without_joint(made(INTECO, 5.0), joint)], INTECO)
    assert put_pole_on_moving_axis(case, make_theta(case.twin)) is None


def test_the_pole_alone_forgets_the_commands_within_a_period() -> None:
    recording = made(INTECO, 10.0, 0.3)
    parts = np.repeat(recording.signals.command[:, None], 2, axis=1)
    divided = replace(recording, signals=replace(recording.signals, parts=parts))
    alone = put_pole_on_moving_axis(prepare_case([divided], INTECO), make_theta(INTECO))
    assert alone is not None and alone.signals.parts is None


def test_laws_of_a_joint_that_was_not_recorded_go() -> None:
    knots, turn = (-1.0, 1.0), tuple(np.arange(4) * np.pi / 2)
    laws = {
        "command_curve": Law(knots, (0.1, 0.0)),
        "pole_torque_by_position": Law(knots, (0.1, 0.0)),
        "angle_error_over_turn": Law(turn, (0.01, 0.0, 0.0, 0.0)),
    }
    twin = replace(INTECO, measured_laws=laws)
    pole = prepare_case([without_joint(made(INTECO, 5.0), "cart")], twin).twin
    assert set(pole.measured_laws) == {"angle_error_over_turn"}
    cart = prepare_case([without_joint(made(INTECO, 5.0), "pole")], twin).twin
    assert set(cart.measured_laws) == {"command_curve"}
