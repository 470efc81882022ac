"""What an effect declares about itself is what its law does."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pendulum_twin.compose import compute_memory_sizes
from pendulum_twin.effects import BY_NAME, CATALOGUE
from pendulum_twin.effects.effect import Effect, Form, Place

every = pytest.mark.parametrize("effect", CATALOGUE, ids=lambda e: e.name)
CONSTANTS = {
    "mass_kg": 0.7,
    "force_per_pwm_n": 12.0,
    "gravity_m_s2": 9.81,
    "coupling_kg_m": 0.0135,
    "inertia_kg_m2": 0.003,
}
STATE = (0.1, 0.3, 2.5, 1.0)  # x, v, th, w: the order in which laws take them
TURN = 2 * np.pi


def choose_values(effect: Effect) -> list[float]:
    """Return values of the parameters at which the effect is clearly there; 1 for a switch."""
    return [p.probes[-1] if p.probes else 0.2 for p in effect.parameters] or [1.0]


def call_filter(effect: Effect, u: float, t: float) -> float:
    memory = np.zeros(effect.memory(1e-3))
    constants = [CONSTANTS[name] for name in effect.constants]
    return effect.law(u, memory, 1e-3, t, *constants, *choose_values(effect))


def call_law(effect: Effect, state: tuple[float, ...], t: float = 0.0) -> np.ndarray:
    """Return what a law of force, gain or of measuring gives for x, v, th, w."""
    if effect.form is Form.GAIN:
        return np.atleast_1d(effect.law(state[0], *choose_values(effect)))
    constants = [CONSTANTS[name] for name in effect.constants]
    if effect.form is Form.DRIVE:
        return np.atleast_1d(effect.law(1.0, state[2], *constants, *choose_values(effect)))
    times = [t] if effect.form is Form.MEASURE else []
    return np.atleast_1d(effect.law(*state, *times, *constants, *choose_values(effect)))


@every
def test_timed_effects_and_no_others_depend_on_the_time(effect):
    if effect.form is Form.FILTER:
        early, late = (call_filter(effect, 0.3, t) for t in (0.0, 100.0))
    elif effect.form is Form.MEASURE:
        early, late = (tuple(call_law(effect, STATE, t)) for t in (0.0, 100.0))
    elif effect.form is Form.TIMED_FORCE:
        early, late = (effect.law(t, *choose_values(effect)) for t in (0.0, np.e))
    elif effect.form is Form.TIMED_MASS:
        constants = [CONSTANTS[name] for name in effect.constants]
        early, late = (effect.law(t, 1e-3, *constants, *choose_values(effect)) for t in (0.0, 9.0))
    elif effect.form is Form.TIMED_FRICTION:
        early, late = (effect.law(t, *choose_values(effect)) for t in (0.0, 100.0))
    else:
        early, late = 0.0, 0.0  # the other forms are not given the time
    assert effect.timed == (early != late)


@every
def test_what_belongs_to_a_recording_counts_its_time(effect):
    assert effect.timed or not effect.of_recording


@every
def test_winding_effects_and_no_others_differ_from_turn_to_turn(effect):
    if effect.form not in (Form.FORCE, Form.MEASURE):
        assert not effect.winds
        return
    x, v, th, w = STATE
    difference = call_law(effect, (x, v, th + TURN, w)) - call_law(effect, STATE)
    turns = difference / TURN
    assert effect.winds == (not np.allclose(turns, np.round(turns), atol=1e-9))


@every
def test_a_sensor_of_one_joint_neither_reads_nor_changes_the_other(effect):
    """`recall_paths` leaves the pole's sensors out where the cart alone remembers its path."""
    if effect.form is not Form.MEASURE:
        assert not effect.of_joint
        return
    chance = np.random.default_rng(1)
    own = {"cart": [0, 1], "pole": [2, 3]}[effect.of_joint]  # of x, v, th, w
    others = [k for k in range(4) if k not in own]
    for _ in range(50):
        state = chance.uniform(-3.0, 3.0, 4)
        other = state.copy()
        other[others] = chance.uniform(-3.0, 3.0, 2)
        t = chance.uniform(0.0, 60.0)
        shown, beside = (call_law(effect, tuple(each), t) for each in (state, other))
        assert np.array_equal(shown[others], state[others])
        assert np.array_equal(shown[own], beside[own])


@every
def test_smooth_effects_stand_where_a_linear_model_has_a_place_for_them(effect):
    if effect.smooth:
        assert effect.form in (Form.FORCE, Form.FILTER, Form.CLOCK)
        assert not effect.is_static and not effect.timed


@pytest.mark.parametrize(
    "effect", [e for e in CATALOGUE if e.smooth and e.form is Form.FORCE], ids=lambda e: e.name
)
def test_the_derivative_of_a_smooth_force_stands_for_it_around_hanging(effect):
    """Twice as far from rest, twice the change of the force, but for terms of second order."""
    rest, way = np.array([0.0, 0.0, np.pi, 0.0]), np.array([1e-5, 1e-5, 1e-5, 1e-5])
    once, twice = (
        call_law(effect, tuple(rest + k * way)) - call_law(effect, tuple(rest)) for k in (1, 2)
    )
    np.testing.assert_allclose(twice, 2 * once, atol=1e-8)


@pytest.mark.parametrize("effect", [e for e in CATALOGUE if e.is_static], ids=lambda e: e.name)
def test_a_static_filter_has_no_memory_and_bends_the_command(effect):
    filters = [e for e in CATALOGUE if e.form is Form.FILTER]
    assert compute_memory_sizes(1e-3)[filters.index(effect)] == 0
    assert any(call_filter(effect, 0.83, t) != 0.83 for t in (0.0, 1.0))


@pytest.mark.parametrize(
    "effect",
    [e for e in CATALOGUE if e.is_static and e.inverse is not None],
    ids=lambda e: e.name,
)
@given(u=st.floats(-1.0, 1.0), t=st.floats(0.0, 5.0))
def test_the_inverse_of_a_static_filter_asks_for_what_the_law_gives(effect, u, t):
    given_by_law = call_filter(effect, u, t)
    command = effect.inverse(given_by_law, t, *choose_values(effect))
    assert call_filter(effect, command, t) == pytest.approx(given_by_law, abs=1e-12)


@pytest.mark.parametrize("place", [Place.CART, Place.POLE])
def test_only_levels_of_dry_friction_hold_a_joint(place):
    """At rest the law gives their sum, wherever the joint is, and nothing without them."""
    for effect in (e for e in CATALOGUE if e.form is Form.DRY and e.place is place):
        values = {p.name: 0.5 for p in effect.parameters}
        holding = sum(values[p.name] for p in effect.parameters if p.holds)
        for position in (-0.3, 0.0, 0.4):
            level = effect.law(0.0, position, *values.values())
            assert level >= holding
            if holding:
                assert level == pytest.approx(holding)


def test_three_times_make_the_motion_late():
    delays = {f"{e.name}.{p.name}": p.unit for e in CATALOGUE for p in e.parameters if p.delays}
    assert delays == {
        "input_delay.delay_s": "s",
        "motor_lag.time_constant_s": "s",
        "sensor_delay.delay_s": "s",
    }


@every
def test_whatever_shows_as_another_effect_says_what_separates_the_two(effect):
    assert (effect.shows_as is not None) == bool(effect.separated_by)


@every
def test_a_factor_on_dry_friction_names_the_friction(effect):
    assert (effect.form is Form.DRY_RATIO) == (effect.acts_beside is not None)
    if effect.acts_beside is not None:
        beside = BY_NAME[effect.acts_beside]
        assert beside.form is Form.DRY and beside.place is effect.place


@every
def test_an_effect_is_a_switch_or_has_a_size_to_search(effect):
    assert effect.is_switch == (not effect.parameters)
    shapes = [p for p in effect.parameters if p.shape]
    assert sorted([*effect.sizes, *shapes], key=effect.parameters.index) == [*effect.parameters]
    if effect.read_off:
        assert effect.place in (Place.SENSOR, Place.CLOCK)
    if effect.needs_both_joints:
        assert effect.place in (Place.SENSOR, Place.CLOCK, Place.CART)
