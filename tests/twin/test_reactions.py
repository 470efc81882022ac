"""The cart acts back on a drive with a mass of its own: against three masses, step by step."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from support.twin_rigs import CART_ALONE, HANGING, THESIS, X, recording, run, wild_command

from pendulum_twin import free_runs
from pendulum_twin.errors import BadInputError
from pendulum_twin.free_runs import recall_paths, run_drive, run_freely
from pendulum_twin.laws.law import Law
from pendulum_twin.model import Twin, parse_twin
from pendulum_twin.parameter_vector import make_theta
from pendulum_twin.rig import Rig

COMMAND = np.where(np.arange(300) // 13 % 2, 0.3, -0.3) * np.sin(0.011 * np.arange(300))
START = (0.0, 2.5, 0.2, 0.0)
BELT = {"stretching_belt": {"period_s": 0.067, "damping": 0.07, "motor_share": 0.1}}
SUBSTEPS = 100


def simulate_motor_cart_and_pole(
    rig: Rig, belt: dict[str, float], start: tuple[float, ...], load_kg: float = 0.0
) -> np.ndarray:
    """Return states (n, 4) of a motor, a cart and a pole; the motor starts with the cart."""
    mass, motor = rig.total_mass_kg, belt["motor_share"] * rig.total_mass_kg
    circular, reduced = 2 * np.pi / belt["period_s"], motor * (1 - belt["motor_share"])
    stiffness, damper = reduced * circular**2, 2 * belt["damping"] * circular * reduced
    moment, inertia = mass * (rig.com_distance_m or 0.0), rig.pole_inertia_kg_m2 or 1.0

    def change(state: np.ndarray, force: float) -> np.ndarray:
        x, th, v, w, at, speed = state
        pull = stiffness * (at - x) + damper * (speed - v)
        push = pull - moment * w**2 * np.sin(th) - rig.cart_viscous_n_s_m * v
        turn = moment * 9.81 * np.sin(th) - (rig.pole_viscous_n_m_s or 0.0) * w
        cross = moment * np.cos(th)
        matrix = np.array([[mass - motor + load_kg, -cross], [-cross, inertia]])
        a, b = np.linalg.solve(matrix, [push, turn])
        return np.array([v, w, a, b, speed, (force - pull) / motor])

    return _integrate(change, np.array([*start, start[0], start[2]]), rig.force_per_pwm_n)


def _integrate(change: Callable[..., np.ndarray], state: np.ndarray, gain: float) -> np.ndarray:
    states, h = [], 0.01 / SUBSTEPS
    for u in gain * COMMAND:
        states.append(state[:4])
        for _ in range(SUBSTEPS):
            a = change(state, u)
            b = change(state + 0.5 * h * a, u)
            c = change(state + 0.5 * h * b, u)
            state = state + h / 6 * (a + 2 * b + 2 * c + change(state + h * c, u))
    return np.array(states)


@pytest.mark.parametrize("share", [0.1, 0.4])
def test_a_cart_and_its_pole_swing_against_the_motor_as_three_masses_do(share):
    belt = BELT["stretching_belt"] | {"motor_share": share}
    truth = simulate_motor_cart_and_pole(THESIS, belt, START)
    states = run(THESIS, COMMAND, {"stretching_belt": belt}, START)
    np.testing.assert_allclose(states[:, :2], truth[:, :2], atol=3e-5)
    light = run(THESIS, COMMAND, {"stretching_belt": belt | {"motor_share": 0.0}}, START)
    assert np.max(np.abs(light - truth)[:, :2]) > 2e-3 * share  # a motor without a mass


def test_friction_of_the_cart_reaches_the_motor_through_the_belt():
    rig, belt = replace(CART_ALONE, cart_viscous_n_s_m=5.0), BELT["stretching_belt"]
    truth = simulate_motor_cart_and_pole(rig, belt, (0.0, 0.0, 0.0, 0.0))
    states = run(rig, COMMAND, BELT, (0.0, 0.0, 0.0, 0.0))
    np.testing.assert_allclose(states[:, X], truth[:, X], atol=3e-6)
    light = {"stretching_belt": belt | {"motor_share": 0.0}}
    states = run(rig, COMMAND, light, (0.0, 0.0, 0.0, 0.0))
    assert np.max(np.abs(states - truth)[:, X]) > 5e-5


def test_a_load_on_the_cart_leaves_the_motor_as_light_as_it_was():
    load = {"load_put_on": {"load_kg": 0.2, "time_s": 0.0}}
    truth = simulate_motor_cart_and_pole(THESIS, BELT["stretching_belt"], START, 0.2)
    states = run(THESIS, COMMAND, BELT | load, START)
    np.testing.assert_allclose(states[:, :2], truth[:, :2], atol=1e-4)


def test_a_window_begins_with_the_swing_that_its_past_leaves():
    whole = run(THESIS, COMMAND, BELT, HANGING)
    signals = replace(recording(COMMAND, 0.01), cart=whole[:, X])
    begin, theta = np.array([60, 155, 233]), make_theta(Twin("test", THESIS, BELT))[None]
    first = np.zeros(3, dtype=np.int64)
    windows = run_freely(signals, theta, first, begin, whole[begin], 50)
    kept = recall_paths(signals, run_drive(signals, theta), theta, first, begin)
    assert np.all(np.abs(kept).max(axis=1) > 0.1)
    for window, k in zip(windows, begin, strict=True):
        np.testing.assert_allclose(window[:, :2], whole[k : k + 50, :2], atol=5e-5)


def test_twins_share_a_path_that_they_keep_the_same_of(monkeypatch):
    """Each of them keeps what it would keep alone, bit by bit; most differ in other numbers."""
    whole = run(THESIS, COMMAND, BELT, HANGING)
    signals = replace(recording(COMMAND, 0.01), cart=whole[:, X], pole=whole[:, 1])
    disc = {"eccentric_encoder": {"sine_rad": 0.1, "cosine_rad": 0.0}}
    laws = {"pole_torque_by_rate": Law((-5.0, 0.0, 5.0), (0.01, 0.0, 0.01))}
    base = Twin("test", THESIS, BELT | disc)
    heavy = replace(THESIS, cart_mass_kg=1.1 * THESIS.cart_mass_kg)
    twins = [
        base,
        replace(base, measured_laws=laws),
        replace(base, rig=replace(THESIS, pole_viscous_n_m_s=0.01)),
        replace(base, rig=heavy),
        replace(base, effects=base.effects | {"input_delay": {"delay_s": 0.02}}),
        replace(base, effects=BELT),
        Twin("test", THESIS, {}),
    ]
    theta = np.array([make_theta(twin) for twin in twins])
    begin, which = np.full(len(twins), 155), np.arange(len(twins))
    alone = [
        recall_paths(signals, run_drive(signals, t[None]), t[None], which[:1], begin[:1])[0]
        for t in theta
    ]
    followed = []
    follow = free_runs.react_to_recorded_path
    monkeypatch.setattr(
        free_runs, "react_to_recorded_path", lambda *a: followed.append(a) or follow(*a)
    )
    together = recall_paths(signals, run_drive(signals, theta), theta, which, begin)
    assert np.array_equal(together, alone)
    assert len(followed) == 3  # the base, a heavier cart, and a delay: a disc moves no cart
    assert len(np.unique(together, axis=0)) >= 4


def test_a_twin_file_may_leave_the_share_out():
    mapping = Twin("test", THESIS, BELT).to_mapping()
    del mapping["effects"]["stretching_belt"]["motor_share"]
    assert parse_twin(mapping).effects["stretching_belt"]["motor_share"] == 0.1
    with pytest.raises(BadInputError, match="stretching_belt: expected damping"):
        parse_twin(mapping | {"effects": {"stretching_belt": {"period_s": 0.06}}})


def test_a_stiff_belt_makes_the_motor_a_part_of_the_cart():
    """In company of a belt that stretches, a stiff belt of any share is exactly no belt."""
    stiff = {"stretching_belt": {"period_s": 0.0, "damping": 0.0, "motor_share": 0.4}}
    command = wild_command(200)
    sets = np.array([make_theta(Twin("test", THESIS, e)) for e in ({}, stiff, BELT)])
    first, starts = np.zeros(3, dtype=np.int64), np.tile(START, (3, 1))
    none, other, _ = run_freely(
        recording(command, 0.01), sets, np.arange(3), first, starts, len(command)
    )
    assert none.tobytes() == other.tobytes()
