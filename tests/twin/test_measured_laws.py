"""A measured law in a twin: absent when empty, the same bits everywhere, bounded, in the file."""

import math
from dataclasses import replace

import numpy as np
import pytest
from support.twin_rigs import THESIS as RIG
from support.twin_rigs import recording, wild_command

from pendulum_twin.effects import CATALOGUE
from pendulum_twin.errors import BadInputError
from pendulum_twin.free_runs import run_freely
from pendulum_twin.law_curves import fill_measured_laws
from pendulum_twin.laws import BY_NAME, KINDS
from pendulum_twin.laws.kind import LIMITS, Role, Variable
from pendulum_twin.laws.law import (
    MOST_LAWS,
    Law,
    evaluate_law,
    make_curve_matrix,
    spread_knots,
    spread_turn,
)
from pendulum_twin.model import Twin, load_twin, save_twin
from pendulum_twin.parameter_vector import LAWS, SIZE, get_laws, make_theta
from pendulum_twin.sensors import apply_sensors, undo_sensors
from pendulum_twin.stepper import Stepper

THESIS = Twin("thesis", RIG)
COMMAND = wild_command(200)
START = (0.0, 2.5, 0.2, 0.0)
SPANS = {
    Variable.COMMAND: (-0.4, 0.4),
    Variable.POSITION: (-0.2, 0.2),
    Variable.VELOCITY: (-0.6, 0.6),
    Variable.RATE: (-6.0, 6.0),
    Variable.TIME: (0.0, 2.0),
    Variable.WAY: (0.01, 0.2),
    Variable.TURN: (0.1, 2.0),
}
TURNS = {Variable.ANGLE: 2 * math.pi, Variable.SHAFT: 0.23}
SIZES = {
    Role.COMMAND: 0.05,
    Role.GAIN: 0.2,
    Role.FORCE: 1.0,
    Role.CART_DRAG: 1.0,
    Role.CART_DRY: 0.5,
    Role.TORQUE: 0.01,
    Role.POLE_DRAG: 0.001,
    Role.POLE_DRY: 0.005,
    Role.CART_HYSTERESIS: 0.3,
    Role.POLE_HYSTERESIS: 0.002,
    Role.CART_ONE_WAY: 1.0,
    Role.POLE_ONE_WAY: 0.001,
    Role.ANGLE_ERROR: 0.05,
    Role.POSITION_ERROR: 0.004,
    Role.PACE: 0.1,
}
every = pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)


def run(twin, command, start):
    first = np.zeros(1, dtype=np.int64)
    return run_freely(
        recording(command, 0.01),
        make_theta(twin)[None],
        first,
        first,
        np.array([start]),
        len(command),
    )[0]


def make_knots(kind, count=9):
    return (
        spread_turn(count, TURNS[kind.variable])
        if kind.is_periodic
        else spread_knots(kind, *SPANS[kind.variable], count)
    )


def make_wavy(kind, size=None):
    knots = make_knots(kind)
    size = SIZES[kind.role] if size is None else size
    return Law(tuple(knots), tuple(size * (0.6 + 0.4 * np.sin(1.7 * np.arange(len(knots))))))


def hold(kind, law):
    return replace(THESIS, measured_laws={kind.name: law})


@every
def test_a_law_of_zeros_gives_the_bits_of_no_law(kind):
    zeros = Law(tuple(make_knots(kind)), (0.0,) * 9)
    if kind.role in (Role.CART_DRY, Role.POLE_DRY):  # the dry code itself cuts steps otherwise
        np.testing.assert_allclose(
            run(hold(kind, zeros), COMMAND, START), run(THESIS, COMMAND, START), atol=1e-12
        )
        return
    np.testing.assert_array_equal(
        run(hold(kind, zeros), COMMAND, START), run(THESIS, COMMAND, START)
    )


@every
def test_a_law_acts_and_steps_have_the_bits_of_a_run(kind):
    twin = hold(kind, make_wavy(kind))
    whole = run(twin, COMMAND, START)
    assert np.max(np.abs(whole - run(THESIS, COMMAND, START))) > 1e-6
    stepper = Stepper(twin, 0.01, START, None)
    steps = [stepper.state] + [stepper.step(u) for u in COMMAND[:-1]]
    np.testing.assert_array_equal(np.array(steps)[:, :2], whole[:, :2])


@every
def test_a_huge_wild_law_leaves_runs_finite(kind):
    random = np.random.default_rng(3)
    size = min(LIMITS[kind.role], 50.0)
    law = Law(tuple(make_knots(kind)), tuple(size * random.choice([-1.0, 1.0], 9)))
    assert np.all(np.isfinite(run(hold(kind, law), COMMAND, START)))


@every
def test_the_twin_file_keeps_a_law(kind, tmp_path):
    twin = hold(kind, make_wavy(kind))
    save_twin(twin, tmp_path / "twin.yaml")
    again = load_twin(tmp_path / "twin.yaml")
    assert again == twin
    assert f"{kind.values_key}: [" in (tmp_path / "twin.yaml").read_text()


def test_a_constant_law_of_force_is_a_tilt():
    force = 0.3
    mass, g = THESIS.rig.total_mass_kg, THESIS.rig.gravity_m_s2
    law = Law((-0.2, 0.0, 0.2), (force,) * 3)
    tilt = {"rail_tilt": {"angle_rad": math.asin(force / (mass * g))}}
    pushed = run(hold(BY_NAME["cart_force_by_position"], law), COMMAND, START)
    tilted = run(replace(THESIS, effects={**THESIS.effects, **tilt}), COMMAND, START)
    np.testing.assert_allclose(pushed[:, 0], tilted[:, 0], atol=2e-4)


def test_a_constant_pace_is_a_wrong_sample_period():
    pace = hold(BY_NAME["clock_pace_over_time"], Law((0.0, 1.0, 2.0), (0.1,) * 3))
    wrong = {**THESIS.effects, "sample_period_error": {"ratio": 1 / 1.1 - 1}}
    slow = replace(THESIS, effects=wrong)
    np.testing.assert_allclose(
        run(pace, COMMAND, START), run(slow, COMMAND, START), rtol=1e-9, atol=1e-12
    )


def test_a_clock_that_wanders_shows_the_same_motion_at_other_stamps():
    stamps = np.arange(len(COMMAND)) * 0.01
    law = Law(tuple(np.linspace(0.0, 2.0, 41)), tuple(0.2 * np.sin(2.0 * np.linspace(0, 2, 41))))
    no_command, bare = np.zeros(len(COMMAND)), Twin("bare", RIG)
    shown = run(replace(bare, measured_laws={"clock_pace_over_time": law}), no_command, START)
    true = run(bare, np.zeros(2 * len(COMMAND)), START)
    times = stamps + 0.1 * (1.0 - np.cos(2.0 * stamps))  # the integral of the pace
    paces = 1.0 + 0.2 * np.sin(2.0 * stamps)
    for column, factor in ((0, 1.0), (1, 1.0), (2, paces), (3, paces)):
        then = np.interp(times, np.arange(len(true)) * 0.01, true[:, column])
        size = np.ptp(then)
        np.testing.assert_allclose(shown[:, column], factor * then, atol=3e-3 * size)


def test_a_gain_multiplies_the_drive_s_force_alone():
    """A shaking bench pushes as much as before where the drive is stronger."""
    shaken = replace(
        THESIS,
        effects={"periodic_force": {"amplitude_n": 0.4, "frequency_hz": 2.0, "phase_rad": 0.5}},
    )
    law = Law((-0.5, 0.5), (0.6, 0.6))
    both = replace(shaken, measured_laws={"drive_gain_along_rail": law})
    still = np.zeros_like(COMMAND)
    np.testing.assert_allclose(run(both, still, START), run(shaken, still, START), atol=1e-12)
    assert not np.allclose(run(both, COMMAND, START), run(shaken, COMMAND, START), atol=1e-3)


def test_a_law_of_constant_dry_friction_is_coulomb_friction():
    law = Law((-0.2, 0.0, 0.2), (0.5,) * 3)
    held = run(hold(BY_NAME["cart_dry_friction_along_rail"], law), COMMAND, START)
    coulomb = {"cart_coulomb_friction": {"level_n": 0.5}}
    named = run(replace(THESIS, effects={**THESIS.effects, **coulomb}), COMMAND, START)
    np.testing.assert_array_equal(held, named)


def test_a_law_of_friction_takes_away_what_is_there_and_no_more():
    coulomb = {"cart_coulomb_friction": {"level_n": 0.5}}
    less = Law((-0.2, 0.0, 0.2), (-2.0,) * 3)
    twin = replace(
        THESIS,
        effects={**THESIS.effects, **coulomb},
        measured_laws={"cart_dry_friction_along_rail": less},
    )
    np.testing.assert_allclose(run(twin, COMMAND, START), run(THESIS, COMMAND, START), atol=1e-12)


def test_a_spring_as_a_law_keeps_the_energy():
    rig = replace(THESIS.rig, cart_viscous_n_s_m=0.0, pole_viscous_n_m_s=0.0)
    knots = np.linspace(-0.5, 0.5, 11)
    law = Law(tuple(knots), tuple(-4.0 * knots))
    twin = Twin("spring", rig, {}, {"cart_force_by_position": law})
    states = run(twin, np.zeros(2000), (0.2, math.pi, 0.0, 0.0))
    turns = states[np.abs(states[:, 2]) < 0.02, 0]
    assert np.max(np.abs(turns)) <= 0.2 * 1.001 and np.max(np.abs(states[1500:, 0])) > 0.15


def test_kernel_and_numpy_have_the_same_curve_constant_beyond_the_knots():
    names = ("cart_force_by_position", "cart_force_over_shaft_turn", "pole_torque_by_angle")
    for name in names:
        kind = BY_NAME[name]
        law = make_wavy(kind)
        at = np.linspace(-9.0, 9.0, 301)
        states = np.zeros((301, 4))
        states[:, 0 if name[0] == "c" else 1] = at
        out = np.empty((301, 5))
        fill_measured_laws(states, np.zeros(301), make_theta(hold(kind, law)), out)
        column = 1 if kind.role is Role.FORCE else 2
        np.testing.assert_allclose(out[:, column], evaluate_law(kind, law, at), atol=1e-12)
    ends = evaluate_law(kind := BY_NAME["cart_force_by_position"], make_wavy(kind), [-9.0, 9.0])
    assert list(ends) == [make_wavy(kind).values[0], make_wavy(kind).values[-1]]


@pytest.mark.parametrize("name", ["cart_force_by_position", "pole_torque_by_angle"])
def test_a_curve_goes_through_its_knots_and_a_line_is_a_line(name):
    kind = BY_NAME[name]
    knots = make_knots(kind)
    np.testing.assert_allclose(make_curve_matrix(kind, knots, knots), np.eye(9), atol=1e-12)
    if not kind.is_periodic:
        at = np.linspace(knots[0], knots[-1], 50)
        np.testing.assert_allclose(
            make_curve_matrix(kind, knots, at) @ (2 * knots + 1), 2 * at + 1
        )


@pytest.mark.parametrize(
    "name",
    ["angle_error_over_turn", "position_error_along_rail", "position_error_over_shaft_turn"],
)
def test_errors_of_sensors_are_undone(name):
    kind = BY_NAME[name]
    theta = make_theta(hold(kind, make_wavy(kind)))[None]
    states = np.random.default_rng(0).normal(0.0, [0.2, 3.0, 0.5, 4.0], (1, 50, 4))
    shown = apply_sensors(states, theta, np.zeros((1, 50)))
    assert np.max(np.abs(shown - states)) > 1e-3
    np.testing.assert_allclose(undo_sensors(shown, theta, np.zeros((1, 50))), states, atol=1e-9)


def test_theta_gives_the_laws_back():
    laws = {kind.name: make_wavy(kind) for kind in KINDS[:MOST_LAWS]}
    theta = make_theta(replace(THESIS, measured_laws=laws))
    for name, law in get_laws(theta).items():
        np.testing.assert_allclose(law.knots, laws[name].knots, atol=1e-12)
        assert law.values == laws[name].values
    assert not np.any(make_theta(THESIS)[LAWS:SIZE])


def test_what_belongs_to_a_recording_and_its_time_is_left_out():
    names = ("cart_force_over_time", "cart_dry_friction_over_time", "cart_force_by_position")
    twin = replace(THESIS, measured_laws={n: make_wavy(BY_NAME[n]) for n in names})
    assert set(twin.drop_recording_effects().measured_laws) == set(names[1:])
    assert set(twin.drop_timed_effects().measured_laws) == {names[2]}


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("spring", {}, "unknown law spring; known are command_curve"),
        ("cart_force_by_position", {"knots": [0, 1]}, "unknown key knots"),
        ("cart_force_by_position", {"knots_m": [0, 1], "values_n": [1]}, "expected 2 to 128"),
        ("cart_force_by_position", {"knots_m": [0, 1], "values_n": [1, 2, 3]}, "as many values_n"),
        ("cart_force_by_position", {"knots_m": [0, 1, 3], "values_n": [1, 2, 3]}, "evenly spaced"),
        ("cart_force_by_position", {"knots_m": [1, 0], "values_n": [1, 2]}, "rising"),
        ("cart_force_by_position", {"knots_m": [0, math.nan], "values_n": [1, 2]}, "nan"),
        ("cart_hysteresis", {"knots_m": [1, 2, 3], "values_n": [1, 2, 3]}, "one ratio"),
        ("pole_torque_by_angle", {"knots_rad": [0, 1, 2, 3], "values_n_m": [0] * 4}, "a turn"),
        ("cart_force_by_position", [1, 2], "expected knots_m and values_n"),
    ],
)
def test_refuses_a_wrong_law(name, content, words):
    with pytest.raises(BadInputError, match="measured_laws") as refused:
        replace(THESIS, measured_laws={name: content})
    assert words in str(refused.value)


def test_lanes_of_other_laws_beside_it_leave_its_bits():
    steady = {"cart_presliding_friction": {"level_n": 0.4, "distance_m": 0.003}}  # a held push
    twins = [THESIS, *(hold(kind, make_wavy(kind)) for kind in KINDS)]
    twins += [replace(twin, effects=steady) for twin in twins]
    sets = np.array([make_theta(twin) for twin in twins])
    set_of = np.arange(len(twins))
    begin = set_of
    starts = np.array(START) + 0.03 * set_of[:, None]
    signals = recording(COMMAND, 0.01)
    together = run_freely(signals, sets, set_of, begin, starts, 60)
    for k, twin in enumerate(twins):
        alone = run_freely(signals, sets[[k]], np.zeros(1, int), begin[[k]], starts[[k]], 60)
        np.testing.assert_array_equal(together[k], alone[0], err_msg=str(twin.measured_laws))


def test_a_law_that_holds_an_effect_acts_where_the_effect_does():
    held = {effect.name: effect for effect in CATALOGUE if effect.law_kind}
    assert len(held) > 20
    for effect in held.values():
        kind = BY_NAME[effect.law_kind]
        assert kind.place is effect.place or effect.name in ("force_ripple", "gain_drift"), kind
