"""Each effect does what its sentence says: one run a formula."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.twin_rigs import (
    CART_ALONE,
    HANGING,
    POLE_ALONE,
    SLIDING_CART,
    TH,
    THESIS,
    V,
    W,
    X,
    run,
    wild_command,
)

from pendulum_twin.effects import BY_NAME

COMMAND = wild_command(300)
START = (0.0, 2.5, 0.2, 0.0)
REST = np.zeros(300)
T = 0.01 * np.arange(300)
MASS, GAIN = SLIDING_CART.cart_mass_kg, SLIDING_CART.force_per_pwm_n


def check_same_motion(effects, command, other=None, start=START, atol=1e-12):
    """Check that a twin with effects moves as another twin does under another command."""
    np.testing.assert_allclose(
        run(THESIS, COMMAND, effects, start), run(THESIS, command, other, start), rtol=0, atol=atol
    )


def test_input_sign_inverted():
    check_same_motion({"input_sign_inverted": {}}, -COMMAND)


@pytest.mark.parametrize("samples", [1, 7, 30])
def test_input_delay_by_whole_samples(samples):
    # before the recording the command is taken to have been what it is at first
    late = np.concatenate([np.full(samples, COMMAND[0]), COMMAND[:-samples]])
    check_same_motion({"input_delay": {"delay_s": samples * 0.01}}, late)


def test_input_delay_between_samples():
    """A step of the command that arrives 12.3 ms late pushes the cart for that much less."""
    step = np.where(T >= 0.1, 0.1, 0.0)
    states = run(SLIDING_CART, step, {"input_delay": {"delay_s": 0.0123}})
    a = 0.1 * GAIN / MASS
    late = np.maximum(T - 0.1123, 0.0)
    np.testing.assert_allclose(states[:, V], a * late, atol=1e-12)
    np.testing.assert_allclose(states[:, X], a * late**2 / 2, atol=1e-6)


def test_input_dead_zone():
    check_same_motion(
        {"input_dead_zone": {"width": 0.1}},
        np.sign(COMMAND) * np.maximum(np.abs(COMMAND) - 0.1, 0.0),
    )


def test_input_saturation():
    check_same_motion({"input_saturation": {"limit": 0.2}}, np.clip(COMMAND, -0.2, 0.2))


def test_coarse_command():
    steps = np.floor(COMMAND / 0.07 + 0.5)
    assert len(np.unique(steps)) > 5
    check_same_motion({"coarse_command": {"step": 0.07}}, 0.07 * steps)


def test_gain_asymmetry():
    check_same_motion(
        {"gain_asymmetry": {"ratio": 0.1}}, np.where(COMMAND > 0, 1.1, 0.9) * COMMAND
    )


def test_gain_drift():
    states = run(SLIDING_CART, REST + 0.1, {"gain_drift": {"per_s": 0.2}})
    np.testing.assert_allclose(states[:, V], 0.1 * GAIN / MASS * (T + 0.2 * T**2 / 2), atol=1e-3)


def test_a_drive_that_fades_is_never_turned_round():
    states = run(SLIDING_CART, REST + 0.1, {"gain_drift": {"per_s": -0.8}})
    until, after = np.minimum(T, 0.9 / 0.8), np.maximum(T - 0.9 / 0.8, 0.0)
    speed = 0.1 * GAIN / MASS * (until - 0.8 * until**2 / 2 + 0.1 * after)
    np.testing.assert_allclose(states[:, V], speed, atol=3e-3)


def test_a_drive_that_grows_ends_at_ten_times():
    """A live twin runs for hours after a recording of a minute."""
    times = 0.01 * np.arange(1200)
    states = run(SLIDING_CART, np.full(1200, 0.01), {"gain_drift": {"per_s": 1.0}})
    until, after = np.minimum(times, 9.0), np.maximum(times - 9.0, 0.0)
    speed = 0.01 * GAIN / MASS * (until + until**2 / 2 + 10.0 * after)
    np.testing.assert_allclose(states[:, V], speed, rtol=1e-3, atol=3e-3)


@pytest.mark.parametrize("ramp_s", [0.03, 0.4567, 2.0])
def test_drive_slew_limit(ramp_s):
    """Up, and at half of the way back: a ramp ends within a substep, or not at all."""
    step = np.where(T >= 0.1, 0.1, 0.0) - np.where(T >= 2.0, 0.15, 0.0)
    states = run(SLIDING_CART, step, {"drive_slew_limit": {"ramp_s": ramp_s}})
    up, down = np.maximum(T - 0.1, 0.0), np.maximum(T - 2.0, 0.0)

    def integrate_ramp(on, size):
        """Return the integral of a ramp from 0 to the size, over the times on (s), s."""
        whole = abs(size) * ramp_s
        return size * np.where(on < whole, on**2 / (2 * whole), on - whole / 2)

    # exact in the velocity, for the mean force of every step is
    speed = GAIN / MASS * (integrate_ramp(up, 0.1) + integrate_ramp(down, -0.15))
    np.testing.assert_allclose(states[:, V], speed, atol=1e-12)


def test_motor_lag():
    tau, step = 0.05, np.where(T >= 0.1, 0.1, 0.0)
    states = run(SLIDING_CART, step, {"motor_lag": {"time_constant_s": tau}})
    on = np.maximum(T - 0.1, 0.0)
    # exact in the velocity, for the mean force of every step is
    np.testing.assert_allclose(
        states[:, V], 0.1 * GAIN / MASS * (on - tau * (1 - np.exp(-on / tau))), atol=1e-12
    )


@pytest.mark.parametrize("gap_m", [0.0011, 0.004, 0.0067])
def test_belt_backlash_is_crossed_in_the_time_of_a_free_motor(gap_m):
    """Whatever the substep in which the motor arrives: the time counts, not the substeps."""
    effect = {"belt_backlash": {"gap_m": gap_m}}
    states = run(SLIDING_CART, np.where(T >= 0.1, 0.1, 0.0), effect)
    crossing_s = np.sqrt(2.0 * gap_m / (0.1 * GAIN / (0.1 * MASS)))
    speed = 0.1 * GAIN / MASS * np.maximum(T - 0.1 - crossing_s, 0.0)
    np.testing.assert_allclose(states[:, V], speed, atol=1e-12)


@pytest.mark.parametrize("damping", [0.0, 0.3])
def test_stretching_belt(damping):
    """A step of the command: the cart swings about the speed that it has with a stiff belt."""
    belt = {"stretching_belt": {"period_s": 0.12, "damping": damping}}
    states = run(SLIDING_CART, np.where(T >= 0.1, 0.1, 0.0), belt)
    on, fades = np.maximum(T - 0.1, 0.0), damping * 2 * np.pi / 0.12
    turning = 2 * np.pi / 0.12 * np.sqrt(1 - damping**2)
    speed = 0.1 * GAIN / MASS * (on - np.exp(-fades * on) * np.sin(turning * on) / turning)
    np.testing.assert_allclose(states[:, V], speed, atol=1e-12)  # of the mean force: exact


def compute_acceleration(effects, state, command=0.0, rig=SLIDING_CART):
    """Return the acceleration of cart and pole at a state, from a very short run."""
    h = 1e-5
    states = run(rig, np.full(2, command), effects, state, h)
    return (states[1, [V, W]] - states[0, [V, W]]) / h


@pytest.mark.parametrize("v", [0.1, -0.1, 0.7, -0.7])
def test_cart_friction_laws(v):
    def force(effects):
        return MASS * compute_acceleration(effects, (0.05, np.pi, v, 0.0))[0]

    speed, way = abs(v), np.sign(v)
    assert force({"cart_coulomb_friction": {"level_n": 0.3}}) == pytest.approx(
        -0.3 * way, abs=1e-4
    )
    stribeck = {"level_n": 0.3, "static_n": 0.2, "velocity_m_s": 0.15}
    curve = 0.3 + 0.2 * np.exp(-((v / 0.15) ** 2))
    assert force({"cart_stribeck_friction": stribeck}) == pytest.approx(-curve * way, abs=1e-4)
    thesis = {"viscous_n_s_m": 1.1976, "level_n": 0.5, "limit_n": 1.0}
    assert force({"cart_saturating_friction": thesis}) == pytest.approx(
        -min(1.1976 * speed + 0.5, 1.0) * way, abs=1e-4
    )
    assert force({"cart_quadratic_drag": {"n_s2_m2": 0.4}}) == pytest.approx(
        -0.4 * v * speed, abs=1e-4
    )
    lopsided = {
        "cart_coulomb_friction": {"level_n": 0.3},
        "cart_friction_asymmetry": {"ratio": 0.2},
    }
    assert force(lopsided) == pytest.approx(-0.3 * (1 + 0.2 * way) * way, abs=1e-4)


@pytest.mark.parametrize("w", [0.5, -0.5, 6.0, -6.0])
def test_pole_friction_laws(w):
    def torque(effects):
        return (
            POLE_ALONE.pole_inertia_kg_m2
            * compute_acceleration(effects, (0.0, np.pi, 0.0, w), rig=POLE_ALONE)[1]
        )

    assert torque({"pole_coulomb_friction": {"level_n_m": 0.004}}) == pytest.approx(
        -0.004 * np.sign(w), abs=1e-5
    )
    assert torque({"pole_quadratic_drag": {"n_m_s2": 1e-4}}) == pytest.approx(
        -1e-4 * w * abs(w), abs=1e-5
    )


def test_cart_quadratic_drag_in_closed_form():
    states = run(
        SLIDING_CART, REST, {"cart_quadratic_drag": {"n_s2_m2": 0.4}}, (0.0, np.pi, 0.9, 0.0)
    )
    np.testing.assert_allclose(states[:, V], 0.9 / (1 + 0.9 * 0.4 / MASS * T), rtol=1e-10)


def test_rail_tilt_is_a_constant_force():
    force = THESIS.total_mass_kg * 9.81 * 0.02
    check_same_motion({"rail_tilt": {"angle_rad": 0.02}}, COMMAND + force / THESIS.force_per_pwm_n)


@pytest.mark.parametrize("v", [0.0, 0.5, -0.5])
def test_motor_current_limit(v):
    """A cart that moves against the force meets the limit earlier, by the counter voltage."""
    limit = {"motor_current_limit": {"limit": 0.2, "counter_share": 0.8}}
    state, counter = (0.0, np.pi, v, 0.0), 0.8 * CART_ALONE.cart_viscous_n_s_m
    free, within, beyond = (
        compute_acceleration(effects, state, command, CART_ALONE)[0] * MASS
        for effects, command in (({}, 0.3), (limit, 0.1), (limit, 0.3))
    )
    friction = CART_ALONE.cart_viscous_n_s_m * v
    assert free == pytest.approx(0.3 * GAIN - friction, rel=1e-4)
    assert within == pytest.approx(0.1 * GAIN - friction, rel=1e-4)
    assert beyond == pytest.approx(0.2 * GAIN - friction + counter * v, rel=1e-4)


def test_a_current_limit_frees_no_more_friction_than_there_is():
    limit = {"motor_current_limit": {"limit": 0.01, "counter_share": 2.0}}
    states = run(CART_ALONE, REST, limit, (0.0, np.pi, 2.0, 0.0))
    assert np.all(np.diff(states[:, V]) <= 1e-12) and states[-1, V] < 1.9


def test_drive_offset_is_a_larger_command_and_the_tilt_of_the_same_force():
    offset = {"drive_offset": {"offset": 0.02}}
    check_same_motion(offset, COMMAND + 0.02)
    tilt = 0.02 * THESIS.force_per_pwm_n / (THESIS.total_mass_kg * 9.81)
    check_same_motion(offset, COMMAND, {"rail_tilt": {"angle_rad": tilt}})
    assert BY_NAME["drive_offset"].shows_as == "rail_tilt"


def test_rail_spring():
    states = run(
        SLIDING_CART,
        REST,
        {"rail_spring": {"n_per_m": 8.0, "centre_m": 0.1}},
        (0.15, np.pi, 0.0, 0.0),
    )
    np.testing.assert_allclose(
        states[:, X] - 0.1, 0.05 * np.cos(np.sqrt(8.0 / MASS) * T), atol=1e-10
    )


def test_cogging():
    effects = {"cogging": {"amplitude_n": 0.4, "period_m": 0.05, "phase_rad": 0.3}}
    for x in (-0.31, 0.0, 0.012, 0.2):
        force = MASS * compute_acceleration(effects, (x, np.pi, 0.0, 0.0))[0]
        assert force == pytest.approx(0.4 * np.sin(2 * np.pi * x / 0.05 + 0.3), abs=1e-6)


@pytest.mark.parametrize("x", [0.0, 0.013, -0.2])
def test_force_ripple(x):
    """The command's force is multiplied; without a command nothing is there."""
    ripple = {"force_ripple": {"ratio": 0.2, "period_m": 0.05, "phase_rad": 0.3}}
    factor = 1.0 + 0.2 * np.sin(2 * np.pi * x / 0.05 + 0.3)
    step_s = 1e-5
    commands = np.array([0.4, 0.4])
    moved, plain = (
        run(SLIDING_CART, commands, effects, (x, 0.0, 0.0, 0.0), step_s)[1, 2]
        for effects in (ripple, {})
    )
    assert moved / plain == pytest.approx(factor, abs=1e-5)
    still = run(SLIDING_CART, 0.0 * commands, ripple, (x, 0.0, 0.1, 0.0), step_s)
    assert np.array_equal(still, run(SLIDING_CART, 0.0 * commands, {}, (x, 0.0, 0.1, 0.0), step_s))


def test_periodic_force():
    """A free cart moves by the force's second integral over time."""
    shaken = {"periodic_force": {"amplitude_n": 0.4, "frequency_hz": 2.0, "phase_rad": 0.3}}
    states, rate = run(SLIDING_CART, REST, shaken), 2 * np.pi * 2.0
    gained = 0.4 * (np.cos(0.3) - np.cos(rate * T + 0.3)) / (rate * MASS)
    np.testing.assert_allclose(states[:, V], gained, atol=1e-6)


def test_presliding_friction_bends_before_it_slips():
    """Below its level the cart comes to rest where spring and push balance; beyond, it slides."""
    level_n, distance_m = 0.8, 0.004
    friction = {"cart_presliding_friction": {"level_n": level_n, "distance_m": distance_m}}
    damped = replace(SLIDING_CART, cart_viscous_n_s_m=30.0)
    pushed = np.full(300, 0.5 * level_n / GAIN)
    states = run(damped, pushed, friction)
    assert states[-1, X] == pytest.approx(distance_m * np.log(2.0), rel=1e-3)
    assert abs(states[-1, V]) < 1e-6
    # let go, the contact springs back, and keeps a part of the way
    back = run(damped, np.where(T < 2.0, pushed, 0.0), friction)[-1, X]
    # dF/dx on the way back is (level - F) / distance: from -level/2 to 0
    assert back == pytest.approx(distance_m * (np.log(2.0) - np.log(1.5)), rel=5e-3)
    # far from any reversal it is dry friction of that level
    sliding = run(SLIDING_CART, np.full(300, 2.0 * level_n / GAIN), friction)
    assert np.diff(sliding[-20:, V]) / 0.01 == pytest.approx(level_n / MASS, rel=1e-6)


def test_stiff_presliding_friction_is_bounded():
    """The stiffest contact of the range stays within its level."""
    friction = {"cart_presliding_friction": {"level_n": 5.0, "distance_m": 1e-5}}
    states = run(THESIS, COMMAND, friction, START)
    free = run(THESIS, COMMAND, {}, START)
    assert np.all(np.isfinite(states))
    assert np.max(np.abs(states[:, X])) < np.max(np.abs(free[:, X])) + 0.1


@pytest.mark.parametrize(("th", "w"), [(np.pi, 0.0), (np.pi, 12.0), (0.0, 12.0), (1.0, -5.0)])
def test_load_friction(th, w):
    """A pole that hangs and whirls presses, one that whirls upright lifts."""
    friction, state = {"cart_load_friction": {"coefficient": 0.1}}, (0.0, th, 1.0, w)
    held, free = (compute_acceleration(e, state, rig=THESIS) for e in (friction, {}))
    mass, moment = THESIS.total_mass_kg, THESIS.total_mass_kg * THESIS.com_distance_m
    turning = moment * 9.81 * np.sin(th) / THESIS.pole_inertia_kg_m2
    load = mass * 9.81 - moment * (w**2 * np.cos(th) + turning * np.sin(th))
    # the pole is moved along, which makes the cart lighter
    lighter = mass - (moment * np.cos(th)) ** 2 / THESIS.pole_inertia_kg_m2
    assert (held - free)[0] * lighter == pytest.approx(-0.1 * load, rel=2e-3)


def test_load_friction_holds_a_cart_on_which_the_pole_hangs():
    push_n = 0.09 * THESIS.total_mass_kg * 9.81
    states = run(
        THESIS,
        np.full(100, push_n / THESIS.force_per_pwm_n),
        {"cart_load_friction": {"coefficient": 0.1}},
    )
    assert not np.any(states[:, [X, V]])


def test_friction_warming():
    """Without a command a sliding cart is braked by what has not warmed away yet."""
    grease = {"level_n": 0.1, "viscous_n_s_m": 0.0, "time_constant_s": 1.5}
    states = run(SLIDING_CART, REST, {"friction_warming": grease}, (0.0, 0.0, 5.0, 0.0))
    lost = 0.1 * 1.5 * (1.0 - np.exp(-T / 1.5)) / MASS
    np.testing.assert_allclose(states[:, V], 5.0 - lost, atol=1e-6)
    grease = {"level_n": 0.0, "viscous_n_s_m": 0.3, "time_constant_s": 1.5}
    states = run(SLIDING_CART, REST, {"friction_warming": grease}, (0.0, 0.0, 5.0, 0.0))
    braked = 0.3 * 1.5 * (1.0 - np.exp(-T / 1.5)) / MASS
    np.testing.assert_allclose(states[:, V], 5.0 * np.exp(-braked), rtol=1e-6)


def test_friction_that_has_not_warmed_away_holds_the_cart():
    grease = {"level_n": 1.0, "viscous_n_s_m": 0.0, "time_constant_s": 1.5}
    push = 0.5 / GAIN  # less than is left until 1.5 ln 2 = 1.04 s
    states = run(SLIDING_CART, REST + push, {"friction_warming": grease})
    assert np.all(states[T < 1.03, X] == 0.0) and states[-1, X] > 0.0


def test_soft_saturation():
    check_same_motion({"soft_saturation": {"limit": 0.3}}, 0.3 * np.tanh(COMMAND / 0.3))


def test_pole_spring():
    p = POLE_ALONE
    weight = p.pole_mass_kg * p.com_distance_m * 9.81
    states = run(p, REST, {"pole_spring": {"n_m_per_rad": 0.05}}, (0.0, np.pi + 1e-4, 0.0, 0.0))
    rate = np.sqrt((weight + 0.05) / p.pole_inertia_kg_m2)
    np.testing.assert_allclose(states[:, TH] - np.pi, 1e-4 * np.cos(rate * T), atol=1e-10)


def test_thesis_dead_zones_hold_the_state_while_all_is_small():
    zones = {
        "thesis_dead_zones": {"force_n": 0.2, "cart_velocity_m_s": 0.1, "pole_velocity_rad_s": 1.5}
    }
    slow = (0.1, 2.5, 0.05, 1.0)
    held = run(THESIS, REST + 0.19 / GAIN, zones, slow)
    assert np.all(held == np.array(slow))
    for command, start in (
        (0.21 / GAIN, slow),
        (0.19 / GAIN, (0.1, 2.5, 0.11, 1.0)),
        (0.19 / GAIN, (0.1, 2.5, 0.05, -1.6)),
    ):
        assert np.all(run(THESIS, REST[:2] + command, zones, start)[1] != np.array(start))


def test_angle_offset():
    measured = run(THESIS, COMMAND, {"angle_offset": {"angle_rad": 0.2}}, START)
    true = run(THESIS, COMMAND, {}, (START[0], START[1] - 0.2, START[2], START[3]))
    np.testing.assert_allclose(
        measured - true, np.tile([0.0, 0.2, 0.0, 0.0], (300, 1)), atol=1e-12
    )


def test_cart_sign_inverted():
    mirrored = run(THESIS, COMMAND, {"cart_sign_inverted": {}}, (-0.1, 2.5, -0.2, 1.0))
    true = run(THESIS, COMMAND, {}, (0.1, 2.5, 0.2, 1.0))
    np.testing.assert_array_equal(mirrored, true * [-1, 1, -1, 1])


def test_angle_sign_inverted():
    mirrored = run(THESIS, COMMAND, {"angle_sign_inverted": {}}, (0.1, 2 * np.pi - 2.5, 0.2, -1.0))
    true = run(THESIS, COMMAND, {}, (0.1, 2.5, 0.2, 1.0))
    np.testing.assert_allclose(
        mirrored, np.array([0, 2 * np.pi, 0, 0]) + true * [1, -1, 1, -1], atol=1e-12
    )


def test_rail_friction_patch():
    patch = {"rail_friction_patch": {"level_n": 0.4, "centre_m": 0.1, "width_m": 0.05}}
    for x, v in ((0.1, 0.2), (0.12, -0.3), (0.3, 0.2)):
        force = MASS * compute_acceleration(patch, (x, np.pi, v, 0.0))[0]
        assert force == pytest.approx(
            -np.sign(v) * 0.4 * np.exp(-(((x - 0.1) / 0.05) ** 2)), abs=1e-4
        )


@pytest.mark.parametrize(("x", "v"), [(0.2, 1.0), (0.3, -0.5), (0.9, 1.0)])
def test_rail_drag_patch(x, v):
    patch = {"rail_drag_patch": {"n_s_per_m": 3.0, "centre_m": 0.2, "width_m": 0.1}}
    force = MASS * compute_acceleration(patch, (x, np.pi, v, 0.0))[0]
    assert force == pytest.approx(-3.0 * v * np.exp(-(((x - 0.2) / 0.1) ** 2)), abs=1e-3)


@pytest.mark.parametrize("load_kg", [0.3, -0.2])
def test_load_put_on(load_kg):
    """A level force gives a velocity whose slope steps; the velocity itself does not."""
    time_s = 0.7653
    load = {"load_put_on": {"load_kg": load_kg, "time_s": time_s}}
    states = run(SLIDING_CART, REST + 0.1, load)
    before, after = np.minimum(T, time_s), np.maximum(T - time_s, 0.0)
    slopes = 0.1 * GAIN / MASS, 0.1 * GAIN / (MASS + load_kg)
    np.testing.assert_allclose(states[:, V], slopes[0] * before + slopes[1] * after, atol=1e-9)
    np.testing.assert_allclose(
        np.diff(states[80:, V]), 0.01 * slopes[1], atol=1e-9
    )  # and all of the load is there


def test_a_load_that_is_taken_off_leaves_a_cart():
    """More mass taken off than there is leaves a twentieth of what the pole does not carry."""
    rig = replace(THESIS, cart_viscous_n_s_m=0.0)
    load = {"load_put_on": {"load_kg": -10.0, "time_s": 0.0}}
    states = run(rig, COMMAND, load, HANGING)
    assert np.all(np.isfinite(states)) and np.ptp(states[:, X]) > 0.0


def test_pole_imbalance():
    """The twin's angle is that of the centre of mass, which hangs straight down."""
    states = run(
        THESIS, REST, {"pole_imbalance": {"angle_rad": 0.1}}, (0.0, np.pi - 0.1, 0.0, 0.0)
    )
    np.testing.assert_allclose(states, np.tile([0.0, np.pi - 0.1, 0.0, 0.0], (300, 1)), atol=1e-12)


def test_eccentric_encoder():
    """The shown angle of every true angle, and its derivative times the true rate."""
    off = {"eccentric_encoder": {"sine_rad": 0.1, "cosine_rad": -0.05}}
    true = run(THESIS, COMMAND, {}, START)
    th, w = true[:, 1], true[:, 3]
    begin = (START[0], th[0] + 0.1 * np.sin(th[0]) - 0.05 * np.cos(th[0]))
    slope = 1.0 + 0.1 * np.cos(th) + 0.05 * np.sin(th)
    shown = run(THESIS, COMMAND, off, (*begin, START[2], START[3] * slope[0]))
    np.testing.assert_allclose(shown[:, 1], th + 0.1 * np.sin(th) - 0.05 * np.cos(th), atol=1e-10)
    np.testing.assert_allclose(shown[:, 3], w * slope, atol=1e-9)
    np.testing.assert_allclose(shown[:, [0, 2]], true[:, [0, 2]], atol=1e-11)


def test_eccentric_pulley():
    pulley = {"eccentric_pulley": {"ratio": 0.2, "period_m": 0.15, "phase_rad": 0.4}}
    true = run(THESIS, COMMAND, {}, START)
    turn = 2 * np.pi / 0.15

    def show(states):
        shown = states.copy()
        shown[:, X] += 0.2 / turn * np.sin(turn * states[:, X] + 0.4)
        shown[:, V] *= 1.0 + 0.2 * np.cos(turn * states[:, X] + 0.4)
        return shown

    start = tuple(show(np.array([START]))[0])
    np.testing.assert_allclose(run(THESIS, COMMAND, pulley, start), show(true), atol=1e-9)


def test_encoder_slip():
    slipped = run(THESIS, COMMAND, {"encoder_slip": {"angle_rad": 0.2, "time_s": 1.0}}, START)
    true = run(THESIS, COMMAND, {}, START)
    np.testing.assert_allclose(
        slipped - true, np.outer(T >= 1.0, [0.0, 0.2, 0.0, 0.0]), atol=1e-12
    )


def test_sensor_delay():
    """From rest, what is reported is what was so long ago."""
    late = run(THESIS, COMMAND, {"sensor_delay": {"delay_s": 0.03}})
    true = run(THESIS, np.concatenate([[0.0, 0.0, 0.0], COMMAND]))
    np.testing.assert_allclose(late, true[:300], atol=1e-12)


@pytest.mark.parametrize("delay_s", [0.0137, 0.03, 0.0007])
def test_angle_delay(delay_s):
    """From rest, the reported angle is that of so long ago, and the position that of now."""
    command = np.concatenate([np.zeros(4), COMMAND])
    late = run(THESIS, command, {"angle_delay": {"delay_s": delay_s}})
    fine = run(THESIS, np.repeat(command, 100), period_s=1e-4)
    then = np.maximum(np.round(100 * np.arange(len(command)) - delay_s / 1e-4), 0).astype(int)
    np.testing.assert_allclose(late[:, [TH, W]], fine[then][:, [TH, W]], atol=1e-4)
    np.testing.assert_allclose(late[:, [X, V]], fine[::100, [X, V]], atol=1e-9)


def test_angle_lag():
    """From rest, the reported angle follows the angle, and the position is that of now."""
    lag_s = 0.02
    run_lagging = run(THESIS, COMMAND, {"angle_lag": {"time_constant_s": lag_s}})
    fine = run(THESIS, np.repeat(COMMAND, 100), period_s=1e-4)
    keep, shown = np.exp(-1e-4 / lag_s), [fine[0, TH]]
    for true in 0.5 * (fine[1:, TH] + fine[:-1, TH]):
        shown.append(keep * shown[-1] + (1 - keep) * true)
    np.testing.assert_allclose(run_lagging[:, TH], shown[::100], atol=1e-4)
    np.testing.assert_allclose(run_lagging[:, [X, V]], fine[::100, [X, V]], atol=1e-9)


def test_angle_scale():
    states = run(THESIS, COMMAND, {"angle_scale": {"ratio": 0.1}}, (0.0, 1.1 * 2.5, 0.2, 0.0))
    np.testing.assert_allclose(
        states, run(THESIS, COMMAND, {}, START) * [1, 1.1, 1, 1.1], atol=1e-11
    )


def test_position_scale():
    states = run(THESIS, COMMAND, {"position_scale": {"ratio": -0.2}}, (0.08, 2.5, 0.16, 0.0))
    true = run(THESIS, COMMAND, {}, (0.1, 2.5, 0.2, 0.0))
    np.testing.assert_allclose(states, true * [0.8, 1, 0.8, 1], atol=1e-11)


def test_velocity_filter():
    tau = 0.05
    states = run(SLIDING_CART, REST + 0.1, {"velocity_filter": {"time_constant_s": tau}})
    np.testing.assert_array_equal(states[:, X], run(SLIDING_CART, REST + 0.1)[:, X])
    keep, expected = np.exp(-0.01 / tau), [0.0]
    for true in 0.1 * GAIN / MASS * T[1:]:
        expected.append(keep * expected[-1] + (1 - keep) * true)
    np.testing.assert_allclose(states[:, V], expected, atol=1e-12)


def test_sample_period_error():
    """By stamps that run too fast a motion takes longer: the same states, slower."""
    stamped = run(
        THESIS,
        COMMAND,
        {"sample_period_error": {"ratio": 0.25}},
        (0.0, 2.5, 0.16, 0.0),
        period_s=0.01,
    )
    true = run(THESIS, COMMAND, {}, START, period_s=0.008)
    np.testing.assert_allclose(stamped, true / [1, 1, 1.25, 1.25], atol=1e-6)


def test_stale_start():
    check_same_motion({"stale_start": {"seconds": 0.5}}, np.where(T < 0.5 - 1e-9, 0.0, COMMAND))


def test_belt_backlash():
    """After a reversal the force is missing while a tenth of the mass, free, crosses the gap."""
    gap, u = 0.002, 0.3
    turn = np.where(T < 0.5, u, -u)
    crossing = np.sqrt(2 * gap * 0.1 * MASS / (u * GAIN))
    states = run(SLIDING_CART, turn, {"belt_backlash": {"gap_m": gap}})
    without = run(SLIDING_CART, turn)
    lost = np.clip(T - 0.5, 0.0, crossing) * u * GAIN / MASS
    np.testing.assert_allclose(states[:, V] - without[:, V], lost, atol=3e-3)
    assert states[-1, V] - without[-1, V] == pytest.approx(crossing * u * GAIN / MASS, rel=0.02)


def test_no_motion_parts_the_delays_or_the_offsets():
    check_same_motion(
        {"sensor_delay": {"delay_s": 0.033}}, COMMAND, {"input_delay": {"delay_s": 0.033}}
    )
    check_same_motion(
        {"pole_imbalance": {"angle_rad": 0.1}}, COMMAND, {"angle_offset": {"angle_rad": -0.1}}
    )
    assert BY_NAME["sensor_delay"].shows_as == "input_delay"
    assert BY_NAME["pole_imbalance"].shows_as == "angle_offset"


def test_no_motion_parts_a_wrong_clock_from_a_wrong_scale():
    """By the stamps the weight is 1/s^2 of itself beside the inertia; by a scale q, too."""
    s = 1.1
    q = s**-2
    mass = THESIS.total_mass_kg
    other = replace(
        THESIS,
        com_distance_m=THESIS.com_distance_m / q,
        pole_inertia_kg_m2=THESIS.pole_inertia_kg_m2 / q**2,
        cart_viscous_n_s_m=THESIS.cart_viscous_n_s_m / s,
        pole_viscous_n_m_s=THESIS.pole_viscous_n_m_s / (s * q**2),
    )
    assert other.total_mass_kg == mass
    by_clock = run(THESIS, COMMAND, {"sample_period_error": {"ratio": s - 1}}, START)
    by_scale = run(other, COMMAND, {"position_scale": {"ratio": q - 1}}, START)
    np.testing.assert_allclose(by_clock, by_scale, atol=2e-5)
    assert BY_NAME["sample_period_error"].shows_as == "position_scale"


def test_back_emf_is_viscous_friction():
    """The catalogue lists no back-EMF: a term -k v is viscous friction, whatever its cause."""
    assert "back_emf" not in BY_NAME
    assert not np.allclose(
        run(CART_ALONE, COMMAND, {"cart_quadratic_drag": {"n_s2_m2": 0.5}}, HANGING),
        run(CART_ALONE, COMMAND),
        atol=1e-3,
    )


def test_every_effect_has_a_check():
    here = Path(__file__).parent
    text = "".join(
        (here / name).read_text() for name in ("test_each_formula.py", "test_dry_friction.py")
    )
    assert [name for name in BY_NAME if f'"{name}"' not in text] == []
