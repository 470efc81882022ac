"""Known answers for effects that are not the engine's own: slack, friction, sensors, clocks."""

import math
from dataclasses import replace

import numpy as np
import pytest

from pendulum_bridge.emulator.drive import make_drive
from pendulum_bridge.emulator.laws import make_cart_load_friction
from pendulum_bridge.emulator.rig import EmulatedRig
from pendulum_bridge.emulator.seal import Concealed
from pendulum_bridge.emulator.sensors import Encoders, Sensors, distort_positions
from pendulum_bridge.emulator.session import record_rig
from pendulum_twin.errors import BadInputError
from pendulum_twin.rig import Rig

EXACT = Encoders(pole_counts=0, cart_step_m=0.0)
MASS, FORCE = 0.6923, 12.86
HANGING = (0.0, math.pi, 0.0, 0.0)
STATE = np.array([0.2, 3.0, 0.0, 0.0])


@pytest.fixture
def apart(endless: Rig) -> Rig:
    """Return a rig without viscous friction whose balanced pole moves independently."""
    return replace(endless, com_distance_m=0.0, cart_viscous_n_s_m=0.0, pole_viscous_n_m_s=0.0)


def driven(
    rig: Rig, effects: dict, seconds: float, command: float = 0.0, start: tuple = HANGING
) -> EmulatedRig:
    emulator = EmulatedRig(Concealed(effects, rig), encoders=EXACT, start=start)
    for _ in range(round(seconds * 100)):
        emulator.step(command)
    return emulator


def test_a_slack_belt_pulls_once_a_free_motor_has_crossed_the_gap() -> None:
    step_s, gap_m, per_command = 1e-4, 0.004, FORCE / MASS
    stage = make_drive({"belt_backlash": {"gap_m": gap_m}}, step_s, per_command)
    crossing_s = math.sqrt(2 * gap_m / (0.2 * per_command * 10))
    given = np.array([stage(0.2) for _ in range(1000)])
    lost_s = np.sum(0.2 - given) / 0.2 * step_s
    assert lost_s == pytest.approx(crossing_s, rel=1e-9)
    assert stage(-0.2) == 0.0 and np.sum(np.diff(given) < 0) == 0


def test_a_motor_that_is_turned_back_within_the_gap_never_pulls() -> None:
    stage = make_drive({"belt_backlash": {"gap_m": 0.01}}, 1e-4, FORCE / MASS)
    there, back = [stage(0.1) for _ in range(50)], [stage(-0.1) for _ in range(120)]
    assert not any(there) and not any(back)  # 5 ms to stop, and sqrt(2) times that to come back
    assert -0.1 < stage(-0.1) < 0 and stage(-0.1) == -0.1


def test_a_motor_that_was_let_go_within_the_gap_coasts_to_its_other_end() -> None:
    stage = make_drive({"belt_backlash": {"gap_m": 0.004}}, 1e-4, FORCE / MASS)
    for command in [0.2] * 100 + [0.0] * 200:
        assert stage(command) == 0.0
    assert stage(0.2) == 0.2


def test_without_a_gap_the_belt_is_not_there() -> None:
    stage = make_drive({"belt_backlash": {"gap_m": 0.0}}, 1e-4, FORCE / MASS)
    assert [stage(u) for u in (0.1, -0.2, 0.0, 0.3)] == [0.1, -0.2, 0.0, 0.3]


def test_saturating_friction_is_constant_where_it_is_clipped_and_grows_below(apart: Rig) -> None:
    effects = {"cart_saturating_friction": {"viscous_n_s_m": 2.0, "level_n": 0.2, "limit_n": 0.8}}
    fast = driven(
        apart, effects, 0.5, start=(0.0, math.pi, 2.0, 0.0)
    ).truth  # clipped above 0.3 m/s
    assert fast[2] == pytest.approx(2.0 - 0.5 * 0.8 / MASS, rel=1e-6)
    slow = driven(apart, effects, 0.1, start=(0.0, math.pi, 0.25, 0.0)).truth
    assert slow[2] == pytest.approx((0.25 + 0.1) * math.exp(-0.1 * 2.0 / MASS) - 0.1, rel=1e-5)


@pytest.mark.parametrize(("way", "level_n"), [(1, 0.6 * 1.3), (-1, 0.6 * 0.7)])
def test_asymmetric_friction_brakes_and_holds_more_one_way(
    way: int, level_n: float, apart: Rig
) -> None:
    effects = {
        "cart_coulomb_friction": {"level_n": 0.6},
        "cart_friction_asymmetry": {"ratio": 0.3},
    }
    moving = driven(apart, effects, 0.2, start=(0.0, math.pi, way * 1.0, 0.0)).truth
    assert moving[2] == pytest.approx(way * (1.0 - 0.2 * level_n / MASS), rel=1e-6)
    assert abs(driven(apart, effects, 0.5, way * 0.97 * level_n / FORCE).truth[0]) < 1e-5
    assert abs(driven(apart, effects, 0.5, way * 1.03 * level_n / FORCE).truth[0]) > 1e-3


def test_asymmetry_alone_is_nothing(apart: Rig) -> None:
    there = driven(apart, {"cart_friction_asymmetry": {"ratio": 0.3}}, 0.3, 0.1).truth
    assert np.array_equal(there, driven(apart, {}, 0.3, 0.1).truth)


def test_a_patch_takes_its_area_out_of_the_motion(apart: Rig) -> None:
    """Work done by the friction: level times width times sqrt(pi), once across."""
    effects = {"rail_friction_patch": {"level_n": 1.0, "centre_m": 0.3, "width_m": 0.1}}
    across = driven(apart, effects, 1.0, start=(-0.3, math.pi, 1.5, 0.0)).truth
    lost = 0.5 * MASS * (1.5**2 - across[2] ** 2)
    assert across[0] > 0.8 and lost == pytest.approx(1.0 * 0.1 * math.sqrt(math.pi), rel=1e-5)


def test_cogging_stores_what_it_takes(apart: Rig) -> None:
    """Energy: the potential of a sin(2 pi x / l + c) is a l/(2 pi) cos(2 pi x / l + c)."""
    amplitude_n, period_m, phase = 0.5, 0.08, 0.7
    effects = {"cogging": {"amplitude_n": amplitude_n, "period_m": period_m, "phase_rad": phase}}
    x, _, v, _ = driven(apart, effects, 0.73, start=(0.0, math.pi, 0.4, 0.0)).truth
    depth = amplitude_n * period_m / math.tau
    stored = depth * (math.cos(math.tau * x / period_m + phase) - math.cos(phase))
    assert 0.5 * MASS * (v**2 - 0.4**2) == pytest.approx(-stored, abs=2e-7)
    assert driven(apart, effects, 0.01).truth[2] == pytest.approx(
        0.01 * amplitude_n * math.sin(phase) / MASS, rel=1e-3
    )


@pytest.mark.parametrize("x", [0.0, 0.02, -0.05])
def test_a_ripple_multiplies_the_command_s_force(x: float, apart: Rig) -> None:
    effects = {"force_ripple": {"ratio": 0.2, "period_m": 0.08, "phase_rad": 0.7}}
    begin = (x, math.pi, 0.0, 0.0)
    factor = 1 + 0.2 * math.sin(math.tau * x / 0.08 + 0.7)
    pushed = driven(apart, effects, 0.01, 0.1, begin).truth
    assert pushed[2] == pytest.approx(0.01 * 0.1 * FORCE * factor / MASS, rel=1e-2)
    assert driven(apart, effects, 0.1, 0.0, begin).truth[2] == 0.0


def test_a_vibration_pushes_a_cart_that_is_left_alone(apart: Rig) -> None:
    """From rest, the velocity is the integral of the force over time."""
    effects = {"periodic_force": {"amplitude_n": 0.5, "frequency_hz": 5.0, "phase_rad": 0.0}}
    for seconds in (0.1, 0.13, 0.2):
        pushed = 0.5 * (1 - math.cos(math.tau * 5.0 * seconds)) / (math.tau * 5.0 * MASS)
        assert driven(apart, effects, seconds).truth[2] == pytest.approx(pushed, abs=1e-6)


def test_friction_that_warms_away_brakes_less_and_less(apart: Rig) -> None:
    """Dry: level tau (1 - exp(-t/tau)) / m is lost; viscous: an exponent of the same integral."""
    begin = (0.0, math.pi, 2.0, 0.0)
    warm_s = 0.5 * (1 - math.exp(-1.0 / 0.5))
    sizes = {"level_n": 0.4, "viscous_n_s_m": 0.0, "time_constant_s": 0.5}
    dry = driven(apart, {"friction_warming": sizes}, 1.0, start=begin).truth
    assert dry[2] == pytest.approx(2.0 - 0.4 * warm_s / MASS, abs=1e-5)
    sizes = {"level_n": 0.0, "viscous_n_s_m": 1.5, "time_constant_s": 0.5}
    wet = driven(apart, {"friction_warming": sizes}, 1.0, start=begin).truth
    assert wet[2] == pytest.approx(2.0 * math.exp(-1.5 * warm_s / MASS), abs=1e-4)


@pytest.mark.parametrize(("th", "w"), [(math.pi, 0.0), (math.pi, 12.0), (0.0, 12.0)])
def test_a_whirling_pole_presses_where_it_hangs_and_lifts_where_it_stands(
    th: float, w: float, nominal: Rig
) -> None:
    level = make_cart_load_friction(nominal, 0.1).level
    moment, step_s = nominal.total_mass_kg * (nominal.com_distance_m or 0.0), 1e-4
    assert level is not None
    level(0.0, 0.0, th, 0.0, w)
    load = nominal.total_mass_kg * 9.81 - moment * w * w * math.cos(th)
    assert level(step_s, 0.0, th + step_s * w, 0.0, w) == pytest.approx(0.1 * load, rel=2e-3)


@pytest.mark.parametrize("x", [0.05, 0.1, -0.2])
def test_a_brake_beside_the_rail_takes_speed_where_it_is(x: float, apart: Rig) -> None:
    effects = {"rail_drag_patch": {"n_s_per_m": 4.0, "centre_m": 0.05, "width_m": 0.1}}
    braked = driven(apart, effects, 0.01, start=(x, math.pi, 0.3, 0.0)).truth[2] - 0.3
    lost = 0.01 * 0.3 * 4.0 * math.exp(-(((x + 0.0015 - 0.05) / 0.1) ** 2)) / MASS
    assert braked == pytest.approx(-lost, rel=5e-2, abs=1e-6)


@pytest.mark.parametrize("load_kg", [0.25, -0.25])
def test_a_load_comes_and_goes_at_its_instant(load_kg: float, apart: Rig) -> None:
    """The cart goes on at its speed, and a level force speeds it up more slowly, or faster."""
    effects = {"load_put_on": {"load_kg": load_kg, "time_s": 0.5}}
    speed = 0.1 * FORCE * (0.5 / MASS + 0.3 / (MASS + load_kg))
    assert driven(apart, effects, 0.8, 0.1).truth[2] == pytest.approx(speed, rel=1e-9)
    assert driven(apart, effects, 0.5, 0.1).truth[2] == pytest.approx(0.1 * FORCE * 0.5 / MASS)


def test_the_weight_of_a_load_pulls_it_down_a_tilted_rail(apart: Rig) -> None:
    """A cart slides down a tilted rail as fast with a load as without."""
    tilt = {"rail_tilt": {"angle_rad": 0.02}}
    heavy = driven(apart, tilt | {"load_put_on": {"load_kg": 0.25, "time_s": 0.5}}, 1.0).truth
    assert heavy == pytest.approx(driven(apart, tilt, 1.0).truth, abs=1e-9)


def test_no_more_than_the_cart_is_taken_off_it(apart: Rig) -> None:
    with pytest.raises(BadInputError, match="load_put_on: load_kg: expected above"):
        driven(apart, {"load_put_on": {"load_kg": -0.9, "time_s": 0.5}}, 1.0)


def test_a_cart_swings_against_the_motor_at_the_other_end_of_the_belt(apart: Rig) -> None:
    """Two masses: their centre goes on evenly, their distance swings with the belt's period."""
    belt = {"stretching_belt": {"period_s": 0.12, "damping": 0.1}}
    turning = math.tau / 0.12 * math.sqrt(1 - 0.1**2)
    for seconds in (0.03, 0.06, 0.15, 0.4):
        fading = math.exp(-0.1 * math.tau / 0.12 * seconds) * math.sin(turning * seconds)
        speed = 0.1 * FORCE / MASS * (seconds - fading / turning)
        assert driven(apart, belt, seconds, 0.1).truth[2] == pytest.approx(speed, rel=1e-4)
    let_go = driven(apart, belt, 1.0, 0.0, (0.1, math.pi, 0.5, 0.0)).truth
    assert let_go[[0, 2]] == pytest.approx([0.6, 0.5])  # motor and cart set out together


def test_bristles_bend_before_they_slip(apart: Rig) -> None:
    """Half of the level bends them by the logarithm of 2; beyond the level the cart slides."""
    effects = {"cart_presliding_friction": {"level_n": 0.8, "distance_m": 0.004}}
    held = driven(replace(apart, cart_viscous_n_s_m=30.0), effects, 3.0, 0.4 / FORCE).truth
    assert held[0] == pytest.approx(0.004 * math.log(2), rel=1e-3) and abs(held[2]) < 1e-6
    sliding = driven(apart, effects, 1.0, 1.6 / FORCE), driven(apart, effects, 1.1, 1.6 / FORCE)
    slow, fast = (emulator.truth[2] for emulator in sliding)
    assert (fast - slow) / 0.1 == pytest.approx(0.8 / MASS, rel=1e-4)


def test_a_drive_that_bends_gives_small_commands_whole_and_no_more_than_its_limit() -> None:
    stage = make_drive({"soft_saturation": {"limit": 0.4}}, 0.01)
    assert stage(0.001) == pytest.approx(0.001, rel=1e-5)
    assert [stage(u) for u in (0.4, -0.4, 40.0)] == pytest.approx(
        [0.4 * math.tanh(1.0), -0.4 * math.tanh(1.0), 0.4]
    )


def test_a_drive_that_counts_gives_whole_steps() -> None:
    stage = make_drive({"coarse_command": {"step": 0.05}}, 0.01)
    assert [stage(u) for u in (0.02, 0.03, -0.07, -0.08, 0.5)] == pytest.approx(
        [0.0, 0.05, -0.05, -0.1, 0.5]
    )


def test_a_pulley_off_its_axis_reads_ahead_and_behind_once_a_turn(apart: Rig) -> None:
    effects = {"eccentric_pulley": {"ratio": 0.2, "period_m": 0.2, "phase_rad": 0.0}}
    for x, ahead in ((0.05, 0.2), (0.15, -0.2), (0.2, 0.0), (0.25, 0.2)):
        shown = driven(apart, effects, 0.0, start=(x, math.pi, 0.0, 0.0)).sample[0]
        assert shown == pytest.approx(x + ahead * 0.2 / math.tau)


def test_an_unbalanced_pole_hangs_beside_its_line(nominal: Rig) -> None:
    still = driven(nominal, {"pole_imbalance": {"angle_rad": 0.1}}, 1.0)
    assert still.sample == pytest.approx([0.0, math.pi - 0.1, 0.0, 0.0], abs=1e-9)
    falling = driven(
        nominal, {"pole_imbalance": {"angle_rad": 0.1}}, 0.1, start=(0.0, 0.1, 0.0, 0.0)
    )
    assert falling.sample[1] > 0.01  # its line is upright, its centre leans counterclockwise


def test_slips_and_scales_change_what_is_shown() -> None:
    slip = {"encoder_slip": {"angle_rad": 0.1, "time_s": 12.0}}
    assert distort_positions(STATE, slip, 11.99) == (0.2, 3.0) and distort_positions(
        STATE, slip, 12.0
    ) == pytest.approx((0.2, 3.1))
    assert distort_positions(STATE, {"angle_scale": {"ratio": 0.02}}) == pytest.approx((0.2, 3.06))
    assert distort_positions(STATE, {"position_scale": {"ratio": -0.1}}) == pytest.approx(
        (0.18, 3.0)
    )
    both = {
        "angle_offset": {"angle_rad": 0.1},
        "angle_scale": {"ratio": 0.1},
        "angle_sign_inverted": {},
    }
    assert distort_positions(STATE, both)[1] == pytest.approx(
        math.tau - 3.1 * 1.1
    )  # in the chain's order


@pytest.mark.parametrize("angle", [0.0, 1.0, 3.0, 4.5])
def test_an_eccentric_disc_reads_ahead_by_its_offset_across_the_line_of_sight(
    angle: float,
) -> None:
    """A disc of radius 1 whose centre lies (0.06, 0.03) beside its axis, read from one side."""
    disc = {"eccentric_encoder": {"sine_rad": 0.06, "cosine_rad": 0.03}}
    state = np.array([0.2, angle, 0.0, 0.0])
    across = np.imag((0.06 + 0.03j) * np.exp(1j * angle))
    assert distort_positions(state, disc) == pytest.approx((0.2, angle + across))
    half_turn = distort_positions(np.array([0.2, angle + np.pi, 0.0, 0.0]), disc)[1]
    assert half_turn == pytest.approx(angle + np.pi - across)


def test_a_slip_comes_at_its_time_by_the_stamps() -> None:
    sensors = Sensors(EXACT, {"encoder_slip": {"angle_rad": 0.1, "time_s": 0.045}}, 0.01)
    assert [sensors.measure(STATE)[1] for _ in range(8)] == pytest.approx([3.0] * 5 + [3.1] * 3)


def test_reported_velocities_are_the_differences_of_two_positions() -> None:
    sensors = Sensors(EXACT, {}, 0.01)
    reported = [sensors.measure(np.array([x, 0.0, 9.0, 9.0])) for x in (0.0, 0.01, 0.03)]
    assert [sample[2] for sample in reported] == pytest.approx([0.0, 1.0, 2.0])


@pytest.mark.parametrize("delay_s", [0.02, 0.0233, 0.0001])
def test_a_delayed_sensor_shows_the_state_of_before(delay_s: float, apart: Rig) -> None:
    emulator = EmulatedRig(
        Concealed({"sensor_delay": {"delay_s": delay_s}}, apart), encoders=EXACT
    )
    shown_m = np.array([emulator.sample[0]] + [emulator.step(0.2)[0] for _ in range(40)])
    since = np.maximum(0.01 * np.arange(41) - delay_s, 0)
    assert shown_m == pytest.approx(0.5 * 0.2 * FORCE / MASS * since**2, abs=1e-7)


@pytest.mark.parametrize("delay_s", [0.02, 0.0233])
def test_a_delayed_angle_is_of_before_and_the_position_of_now(
    delay_s: float, endless: Rig
) -> None:
    start = (0.0, np.pi + 0.5, 0.0, 0.0)
    late, prompt = (
        EmulatedRig(Concealed(effects, endless), encoders=EXACT, start=start)
        for effects in ({"angle_delay": {"delay_s": delay_s}}, {})
    )
    shown = np.array([late.sample[:2]] + [late.step(0.2)[:2] for _ in range(40)])
    true = np.array([prompt.sample[:2]] + [prompt.step(0.2)[:2] for _ in range(40)])
    assert shown[:, 0] == pytest.approx(true[:, 0], abs=1e-12)
    before = np.interp(0.01 * np.arange(41) - delay_s, 0.01 * np.arange(41), true[:, 1])
    assert shown[:, 1] == pytest.approx(before, abs=2e-3)
    assert np.max(np.abs(shown - true)[:, 1]) > 0.05


def test_a_lagging_angle_approaches_the_angle_and_the_position_is_of_now(endless: Rig) -> None:
    start, lag_s = (0.0, np.pi + 0.5, 0.0, 0.0), 0.03
    lagging, prompt = (
        EmulatedRig(Concealed(effects, endless), encoders=EXACT, start=start)
        for effects in ({"angle_lag": {"time_constant_s": lag_s}}, {})
    )
    shown = np.array([lagging.sample[:2]] + [lagging.step(0.2)[:2] for _ in range(40)])
    true = np.array([prompt.sample[:2]] + [prompt.step(0.2)[:2] for _ in range(40)])
    assert shown[:, 0] == pytest.approx(true[:, 0], abs=1e-12)
    middles, left = 0.5 * (true[1:, 1] + true[:-1, 1]), math.exp(-0.01 / lag_s)
    followed = [true[0, 1]]
    for middle in middles:
        followed.append(middle + left * (followed[-1] - middle))
    assert shown[:, 1] == pytest.approx(followed, abs=2e-3)
    assert np.max(np.abs(shown - true)[:, 1]) > 0.05


@pytest.mark.parametrize("ratio", [0.05, -0.05])
def test_a_fast_clock_stamps_more_time_than_passes(ratio: float, apart: Rig) -> None:
    emulator = driven(apart, {"sample_period_error": {"ratio": ratio}}, 1.0, 0.2)
    assert emulator.period_s == 0.01
    speed = 0.2 * FORCE / MASS / (1 + ratio)
    assert emulator.truth[2] == pytest.approx(speed, rel=1e-9)
    believed = (speed - 0.2 * FORCE / MASS / (1 + ratio) * 0.005) / (
        1 + ratio
    )  # of the last period, by the stamps
    assert emulator.sample[2] == pytest.approx(believed, rel=1e-9)


@pytest.mark.parametrize("seed", range(6))
def test_a_stale_start_belongs_to_no_run(seed: int, nominal: Rig) -> None:
    concealed = Concealed({"stale_start": {"seconds": 0.745}}, nominal)
    emulator = EmulatedRig(concealed, encoders=EXACT, seed=seed)
    log = record_rig(emulator, lambda sample: 0.3, 120)
    own = record_rig(EmulatedRig(Concealed({}, nominal), encoders=EXACT), lambda sample: 0.3, 45)
    assert emulator.stale_samples == 75
    assert np.array_equal(
        log.positions[75:], own.positions
    )  # the run is as if nothing had been before it
    assert np.any(log.commands[:75]) and np.all(log.commands[75:] == 0.3)


def test_stale_starts_stand_or_move(nominal: Rig) -> None:
    moved = []
    for seed in range(12):
        emulator = EmulatedRig(
            Concealed({"stale_start": {"seconds": 0.3}}, nominal), encoders=EXACT, seed=seed
        )
        moved.append(
            bool(np.ptp(record_rig(emulator, lambda sample: 0.0, 30).positions[:, 1]) > 0.05)
        )
    assert 2 < sum(moved) < 10
