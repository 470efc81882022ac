"""The same inputs give the same bits: run after run, beside any lanes, with any code."""

from dataclasses import replace

import numpy as np
import pytest
from support.twin_rigs import CART_ALONE, POLE_ALONE, THESIS, recording, run, wild_command

from pendulum_twin import kernel
from pendulum_twin.block import PATH_SIZE
from pendulum_twin.free_runs import run_drive, run_freely
from pendulum_twin.mechanics import run_mechanics
from pendulum_twin.model import Twin
from pendulum_twin.motion import LAW_SETS, NO_LAWS, PLAIN_LAWS
from pendulum_twin.parameter_vector import make_theta
from pendulum_twin.signals import join_signals
from pendulum_twin.stepper import Stepper

COMMAND = wild_command(200)
START = (0.0, 2.5, 0.2, 0.0)
TWINS = {
    "base": (THESIS, {}),
    "cart alone": (CART_ALONE, {"cart_coulomb_friction": {"level_n": 0.6}}),
    "pole alone": (POLE_ALONE, {"pole_coulomb_friction": {"level_n_m": 0.002}}),
    "plain laws": (
        THESIS,
        {"cart_quadratic_drag": {"n_s2_m2": 0.2}, "rail_tilt": {"angle_rad": 0.01}},
    ),
    "dry": (
        THESIS,
        {"cart_coulomb_friction": {"level_n": 1.2}, "pole_coulomb_friction": {"level_n_m": 0.003}},
    ),
    "held": (
        THESIS,
        {
            "cart_presliding_friction": {"level_n": 0.4, "distance_m": 0.003},
            "periodic_force": {"amplitude_n": 0.3, "frequency_hz": 1.7, "phase_rad": 1.0},
        },
    ),
    "reacting": (
        THESIS,
        {
            "stretching_belt": {"period_s": 0.07, "damping": 0.1, "motor_share": 0.2},
            "cart_coulomb_friction": {"level_n": 0.6},
            "force_ripple": {"ratio": 0.1, "period_m": 0.1, "phase_rad": 0.3},
        },
    ),
    "asked apart": (
        THESIS,
        {
            "motor_current_limit": {"limit": 0.3, "counter_share": 0.8},
            "cart_load_friction": {"coefficient": 0.05},
            "friction_warming": {
                "level_n": 0.3,
                "viscous_n_s_m": 0.4,
                "time_constant_s": 1.0,
            },
            "load_put_on": {"load_kg": 0.2, "time_s": 0.7},
            "rail_friction_patch": {"level_n": 0.5, "centre_m": 0.1, "width_m": 0.1},
            "rail_drag_patch": {"n_s_per_m": 2.0, "centre_m": -0.1, "width_m": 0.2},
        },
    ),
    "all at once": (
        THESIS,
        {
            "input_delay": {"delay_s": 0.0234},
            "input_dead_zone": {"width": 0.02},
            "gain_drift": {"per_s": 0.01},
            "motor_lag": {"time_constant_s": 0.03},
            "cart_stribeck_friction": {"level_n": 0.8, "static_n": 0.4, "velocity_m_s": 0.05},
            "cart_friction_asymmetry": {"ratio": 0.1},
            "cart_presliding_friction": {"level_n": 0.4, "distance_m": 0.003},
            "cogging": {"amplitude_n": 0.3, "period_m": 0.04, "phase_rad": 1.0},
            "pole_coulomb_friction": {"level_n_m": 0.002},
            "angle_offset": {"angle_rad": 0.05},
            "cart_sign_inverted": {},
        },
    ),
    "thesis": (
        THESIS,
        {
            "cart_saturating_friction": {"viscous_n_s_m": 1.1976, "level_n": 0.5, "limit_n": 1.0},
            "thesis_dead_zones": {
                "force_n": 0.2,
                "cart_velocity_m_s": 0.1,
                "pole_velocity_rad_s": 1.5,
            },
        },
    ),
}
named = pytest.mark.parametrize("name", TWINS)


def choose_theta(name):
    rig, effects = TWINS[name]
    return make_theta(Twin(name, rig, effects))


@named
def test_run_after_run(name):
    rig, effects = TWINS[name]
    assert (
        run(rig, COMMAND, effects, START).tobytes() == run(rig, COMMAND, effects, START).tobytes()
    )


@named
def test_step_by_step_as_in_one_run(name):
    rig, effects = TWINS[name]
    whole = run(rig, COMMAND, effects, START)
    stepper = Stepper(Twin(name, rig, effects), 0.01, START, before=None)
    steps = np.array([stepper.state, *(stepper.step(u) for u in COMMAND[:-1])])
    assert steps.tobytes() == whole.tobytes()


@named
def test_a_reset_stepper_is_a_new_one(name):
    """Of a motion before the reset no force is left: no delay, no lag, no strain of friction."""
    twin = Twin(name, *TWINS[name])
    stepper = Stepper(twin, 0.01, (0.1, 1.0, 1.5, -3.0))
    fresh = Stepper(twin, 0.01, START)
    for u in COMMAND[:50]:
        stepper.step(u)
    stepper.reset(START)
    for u in COMMAND[:50]:
        assert stepper.step(u).tobytes() == fresh.step(u).tobytes()


def test_a_returned_state_is_not_changed_by_later_steps():
    stepper = Stepper(Twin("test", THESIS), 0.01, START)
    first = stepper.step(0.3)
    kept = first.copy()
    first += 1.0
    second = stepper.step(0.3)
    assert not np.array_equal(second, first)
    fresh = Stepper(Twin("test", THESIS), 0.01, START)
    assert fresh.step(0.3).tobytes() == kept.tobytes()
    assert fresh.step(0.3).tobytes() == second.tobytes()


@pytest.mark.parametrize("lanes", [2, 16, 17, 35])
def test_alone_as_in_any_company(lanes):
    """Beside lanes with other theta, start states and begins, in full and part-filled blocks."""
    names = [list(TWINS)[k % len(TWINS)] for k in range(lanes)]
    sets = np.array([choose_theta(name) for name in TWINS])
    set_of = np.arange(lanes) % len(TWINS)
    begin = np.arange(lanes) % 50
    starts = np.array(START) + 0.03 * np.arange(lanes)[:, None]
    signals = recording(COMMAND, 0.01)
    together = run_freely(signals, sets, set_of, begin, starts, 100)
    for k, name in enumerate(names):
        alone = run_freely(
            signals, choose_theta(name)[None], np.zeros(1, int), begin[[k]], starts[[k]], 100
        )
        assert alone[0].tobytes() == together[k].tobytes(), name


def run_lanes(theta, width, laws, dry):
    signals = recording(COMMAND, 0.01)
    drives, _ = run_drive(signals, theta[None])
    out, zeros = np.empty((3, 200, 4)), np.zeros(3, dtype=np.int64)
    starts = np.array(START) + 0.1 * np.arange(3)[:, None]
    kernel.integrate_lanes(
        (0,) * width,
        laws,
        dry,
        None,
        drives,
        zeros,
        zeros,
        zeros,
        starts,
        np.zeros((3, PATH_SIZE)),
        theta[None],
        zeros,
        1e-3,
        10,
        out,
    )
    return out


@pytest.mark.parametrize("width", [1, kernel.WIDTH])
@pytest.mark.parametrize("laws", LAW_SETS, ids=["none", "plain", "all"])
@pytest.mark.parametrize("dry", [False, True])
def test_laws_that_are_off_add_exactly_nothing(width, laws, dry):
    assert np.array_equal(
        run_lanes(choose_theta("base"), width, laws, dry),
        run_lanes(choose_theta("base"), 1, NO_LAWS, False),
    )


@pytest.mark.parametrize("name", ["plain laws", "dry", "thesis"])
def test_switched_laws_that_are_off_add_exactly_nothing(name):
    least_code = run_lanes(choose_theta(name), 16, PLAIN_LAWS, True)
    for laws in LAW_SETS[LAW_SETS.index(PLAIN_LAWS) + 1 :]:
        assert np.array_equal(run_lanes(choose_theta(name), 16, laws, True), least_code)


def test_run_mechanics_begins_where_it_is_told():
    signals = recording(COMMAND, 0.01)
    whole = run_freely(
        signals,
        choose_theta("base")[None],
        np.zeros(1, int),
        np.zeros(1, int),
        np.array([START]),
        200,
    )[0]
    rest = run_freely(
        signals, choose_theta("base")[None], np.zeros(1, int), np.array([80]), whole[[80]], 120
    )[0]
    assert rest.tobytes() == whole[80:].tobytes()


def test_drives_of_stretches_start_afresh():
    """A delay does not carry the end of one recording into the next."""
    single = recording(COMMAND, 0.01)
    drives, row_of = run_drive(join_signals([single, single]), choose_theta("all at once")[None])
    assert row_of.tolist() == [0]
    assert drives[0, :2000].tobytes() == drives[0, 2000:].tobytes()


def test_time_goes_on_over_a_gap():
    """A gain that drifts has drifted on when the recording comes back after a gap."""
    twin = make_theta(Twin("drifting", THESIS, {"gain_drift": {"per_s": 0.01}}))[None]
    gap = replace(recording(np.ones(20), 0.01), stretch_begins=(0, 10), begin_s=(0.0, 5.0))
    drives, _ = run_drive(gap, twin)
    np.testing.assert_allclose(drives[0, [0, 100]], [1.0, 1.05])


def test_twins_with_the_same_drive_share_its_row():
    drives, row_of = run_drive(
        recording(COMMAND, 0.01),
        np.array([choose_theta(n) for n in ("base", "all at once", "dry")]),
    )
    assert len(drives) == 2
    assert row_of[0] == row_of[2] != row_of[1]


def test_a_block_is_as_wide_as_it_says():
    out = np.empty((3, 2, 4))
    drives, zeros = np.zeros((1, 10)), np.zeros(3, dtype=np.int64)
    starts, sets = np.tile(START, (3, 1)), np.tile(choose_theta("base"), (3, 1))
    run_mechanics(drives, zeros, zeros, zeros, starts, sets, 1e-3, 10, out)
    assert np.array_equal(out[0], out[2])
