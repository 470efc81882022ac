"""What remembers the path of the joints: what a recorded path leaves, and where a run begins."""

from dataclasses import replace

import numpy as np
import pytest
from support.twin_rigs import CART_ALONE, TH, THESIS, X, recording, wild_command

from pendulum_twin.compose import KEPT
from pendulum_twin.free_runs import recall_paths, run_drive, run_freely
from pendulum_twin.hysteresis import POLE_STRAINS
from pendulum_twin.laws.law import Law
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import make_theta
from pendulum_twin.path_memory import drop_angle_sensors, follow_recorded_path, select_path_columns

COMMAND = wild_command(300)
FRICTION = {"cart_presliding_friction": {"level_n": 0.8, "distance_m": 0.05}}
WAYS = (0.02, 0.04, 0.08)
HYSTERESIS = {
    "cart_hysteresis": Law(WAYS, (0.3, 0.1, 0.5)),
    "pole_hysteresis": Law((0.2, 0.6, 1.8), (0.0, 0.004, 0.0)),
}
TWINS = {
    "effect": Twin("test", THESIS, FRICTION),
    "laws": Twin("test", THESIS, measured_laws=HYSTERESIS),
}
STILL = recording(np.zeros(100), 0.01)


def follow(twin, x, signals=STILL, th=None):
    places = np.stack([x, np.zeros(len(x)) if th is None else th], axis=1)
    return follow_recorded_path(signals, places, make_theta(twin), np.arange(len(x)))


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("twin", TWINS.values(), ids=TWINS)
def test_a_window_begins_with_the_memory_that_its_past_leaves(twin, sign):
    wiring = {"cart_sign_inverted": {}} if sign < 0.0 else {}
    twin = replace(twin, effects={**twin.effects, **wiring})
    theta, first = make_theta(twin)[None], np.zeros(1, dtype=np.int64)
    still = recording(COMMAND, 0.01)
    whole = run_freely(still, theta, first, first, np.array([[0.0, 2.5, 0.2, 0.0]]), 300)[0]
    signals = replace(still, cart=whole[:, X], pole=whole[:, TH])
    begin = np.array([60, 150, 233])
    windows = run_freely(signals, theta, np.zeros(3, dtype=np.int64), begin, whole[begin], 50)
    for window, k in zip(windows, begin, strict=True):
        np.testing.assert_allclose(window, whole[k : k + 50], atol=2e-3)


def test_a_path_is_forgotten_where_a_new_stretch_begins():
    x = np.concatenate([np.linspace(0.0, 0.2, 50), np.full(50, 0.9)])
    memory, loads = follow(TWINS["effect"], x, STILL.break_at([50]))
    assert memory[49, 0] == loads[49, 0] == pytest.approx(-0.8 * (1.0 - np.exp(-4.0)))
    assert not np.any(memory[50:])
    assert not np.any(follow(TWINS["laws"], x, STILL.break_at([50]))[1][50:])


def test_a_path_that_goes_on_is_slipping_and_one_that_turns_round_springs_back():
    x = np.concatenate([np.linspace(0.0, 1.0, 50), np.linspace(1.0, 0.965, 50)])
    _, loads = follow(TWINS["effect"], x)
    assert loads[49, 0] == pytest.approx(-0.8)
    assert loads[99, 0] == pytest.approx(0.8 * (1.0 - 2.0 * np.exp(-0.7)))


def test_elements_strain_slip_and_spring_back_each_on_its_way():
    x = np.concatenate([np.linspace(0.0, 1.0, 50), np.linspace(1.0, 0.95, 50)])
    memory, loads = follow(TWINS["laws"], x, th=0.5 * x)
    assert memory[49, KEPT : KEPT + 3] == pytest.approx(WAYS)
    assert loads[49] == pytest.approx((-0.9, -0.004 * 0.5 / 0.6))
    assert memory[99, KEPT : KEPT + 3] == pytest.approx((-0.02, -0.01, 0.03))
    assert loads[99, 0] == pytest.approx(0.3 + 0.1 * 0.01 / 0.04 - 0.5 * 0.03 / 0.08)
    assert memory[99, KEPT + POLE_STRAINS + 1] == pytest.approx(0.475)


def test_only_the_memory_that_is_asked_for_is_kept():
    x = np.concatenate([np.linspace(0.0, 0.2, 50), np.linspace(0.5, 0.3, 50)])
    signals, theta = STILL.break_at([50]), make_theta(TWINS["laws"])
    places, at = np.stack([x, x], axis=1), np.array([3, 49, 50, 98])
    whole, loads = follow(TWINS["laws"], x, signals, th=x)
    memory, same = follow_recorded_path(signals, places, theta, at)
    np.testing.assert_array_equal(memory, whole[at])
    np.testing.assert_array_equal(same, loads)


def test_twins_whose_elements_differ_in_friction_alone_remember_the_same():
    stiffer = replace(TWINS["laws"], measured_laws={"cart_hysteresis": Law(WAYS, (0.4, 0.2, 0.5))})
    softer = replace(stiffer, measured_laws={"cart_hysteresis": Law(WAYS, (0.4, 0.0, 0.5))})
    wider = replace(stiffer, measured_laws={"cart_hysteresis": Law((0.1, 0.2), (0.4, 0.2))})
    pushed = Law((-1.0, 1.0), (0.5, 0.5))
    with_curve = {**stiffer.measured_laws, "cart_force_by_position": pushed}
    twins = [stiffer, replace(stiffer, measured_laws=with_curve), softer, wider]
    twins += [replace(stiffer, effects={"cart_sign_inverted": {}})]
    columns = select_path_columns(np.array([make_theta(twin) for twin in twins]))
    _, group = np.unique(columns, axis=0, return_inverse=True)
    assert len(set(group.reshape(-1).tolist())) == 4
    assert group.reshape(-1)[0] == group.reshape(-1)[1]


@pytest.mark.parametrize(("joint", "groups"), [("cart", 2), ("pole", 3)])
def test_the_angle_of_the_pole_counts_where_its_way_is_remembered(joint: str, groups: int):
    plain = replace(
        TWINS["laws"], measured_laws={f"{joint}_hysteresis": Law(WAYS, (0.4, 0.2, 0.5))}
    )
    turned = replace(plain, effects={"angle_scale": {"ratio": 0.02}})
    shifted = replace(plain, effects={"position_scale": {"ratio": 0.02}})
    theta = np.array([make_theta(t) for t in (plain, turned, shifted)])
    columns = select_path_columns(drop_angle_sensors(theta))
    assert len(np.unique(columns, axis=0)) == groups


def test_each_run_recalls_the_memory_of_its_own_twin_and_begin():
    laws = TWINS["laws"]
    stiffer = replace(laws, measured_laws={**HYSTERESIS, "cart_hysteresis": Law(WAYS, (1, 1, 1))})
    wider = replace(laws, measured_laws={"cart_hysteresis": Law((0.1, 0.2), (0.4, 0.2))})
    theta = np.array([make_theta(twin) for twin in (laws, stiffer, wider)])
    x = 0.3 * np.sin(np.linspace(0.0, 9.0, 100))
    signals, places = replace(STILL, cart=x, pole=2.0 * x), np.stack([x, 2.0 * x], axis=1)
    set_of, begin = np.array([0, 2, 1, 0]), np.array([90, 20, 90, 55])
    recalled = recall_paths(signals, run_drive(signals, theta), theta, set_of, begin)
    for k, (twin, at) in enumerate(zip(set_of, begin, strict=True)):
        memory, _ = follow_recorded_path(signals, places, theta[twin], np.array([at]))
        assert np.any(memory)
        np.testing.assert_array_equal(recalled[k], memory[0])


def test_a_round_trip_costs_the_work_of_slipping():
    twin = Twin("test", THESIS, measured_laws={"cart_hysteresis": Law((0.02, 0.04), (0.0, 0.7))})
    there = 0.15 * np.sin(np.linspace(0.0, 4.0 * np.pi, 4000))
    _, loads = follow(twin, there, recording(np.zeros(4000), 0.01))
    second = slice(2000, 4000)
    work = np.sum(0.5 * (loads[second, 0][1:] + loads[second, 0][:-1]) * np.diff(there[second]))
    assert work == pytest.approx(-0.7 * 4.0 * (0.15 - 0.04), rel=1e-3)


def test_a_run_obeys_what_its_own_path_leaves():
    law = Law((0.005, 0.01, 0.02, 0.04), (0.0, 0.4, 0.0, 0.3))
    twin = Twin("test", CART_ALONE, measured_laws={"cart_hysteresis": law})
    signals = recording(np.repeat([0.3, -0.2, 0.25], 500), 1e-3)
    theta, first = make_theta(twin)[None], np.zeros(1, dtype=np.int64)
    x, _, v, _ = run_freely(signals, theta, first, first, np.zeros((1, 4)), 1500)[0].T
    _, loads = follow(twin, x, signals)
    mass, gain, viscous = CART_ALONE.total_mass_kg, *get_constants(CART_ALONE)
    mean_v = 0.5 * (v[1:] + v[:-1])
    force = mass * np.diff(v) / 1e-3 + viscous * mean_v - gain * signals.command[:-1]
    np.testing.assert_allclose(force, 0.5 * (loads[1:, 0] + loads[:-1, 0]), atol=5e-3)
    assert np.ptp(force) > 1.0


def get_constants(rig):
    return rig.force_per_pwm_n, rig.cart_viscous_n_s_m
