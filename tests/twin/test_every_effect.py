"""Every effect of the catalogue times every generic check."""

import string

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.twin_rigs import CART_ALONE, POLE_ALONE, THESIS, run, wild_command

from pendulum_twin import kernel
from pendulum_twin.compose import compute_memory_sizes
from pendulum_twin.effects import BY_NAME, CATALOGUE
from pendulum_twin.effects.effect import Effect, Form, Place, Scale
from pendulum_twin.model import Twin, load_twin, save_twin
from pendulum_twin.parameter_vector import (
    BASE,
    LAWS,
    NEUTRAL,
    SLOTS,
    find_active_effects,
    get_neutral_values,
    make_theta,
)
from pendulum_twin.sensors import apply_sensors, undo_sensors

COMMAND = wild_command(200)
START = (0.0, 2.5, 0.2, 0.0)
every = pytest.mark.parametrize("effect", CATALOGUE, ids=lambda e: e.name)
# What one unit of each scale is on the thesis's rig, roughly.
TYPICAL = {
    Scale.ONE: 1.0,
    Scale.COMMAND: 0.4,
    Scale.FORCE: 5.0,
    Scale.TORQUE: 0.08,
    Scale.CART_SPEED: 0.5,
    Scale.CART_TRAVEL: 0.3,
    Scale.POLE_RATE: 5.0,
    Scale.SECONDS: 2.0,
    Scale.CLOCK_END: 2.0,
}


def choose_typical_values(effect: Effect) -> dict[str, dict[str, float]]:
    """Return the effect as a twin file would have it, clearly there but of a believable size."""
    values = {}
    for p in effect.parameters:
        probe = p.probes[-1] if p.probes else 0.2
        value = probe * TYPICAL[p.scale] / TYPICAL[p.per] ** p.per_power
        values[p.name] = min(max(value, p.low), p.high)
    return {effect.name: values}


def make_neutral_values(effect: Effect) -> dict[str, dict[str, float]]:
    return {effect.name: {p.name: p.neutral for p in effect.parameters}}


def test_stands_in_the_order_of_the_chain():
    order = [list(Place).index(e.place) for e in CATALOGUE if e.place is not Place.CLOCK]
    assert order == sorted(order)


@every
def test_has_a_sentence_with_every_parameter_and_a_source(effect):
    fields = {name for _, name, _, _ in string.Formatter().parse(effect.sentence) if name}
    assert fields == {p.name for p in effect.parameters}
    assert effect.sentence.endswith(".")
    assert len(effect.source) > 10 or effect.source == "Hooke's law"
    assert effect.law.__doc__


@every
def test_has_parameters_with_units_and_ranges(effect):
    for p in effect.parameters:
        assert p.low <= p.neutral <= p.high
        assert p.unit
        assert np.all(np.isfinite([p.low, p.high, p.neutral]))
        if effect.searched:
            assert p.probes
        for probe in p.probes:
            value = probe * TYPICAL[p.scale] / TYPICAL[p.per] ** p.per_power
            assert p.low <= value <= p.high, (p.name, probe)


@every
def test_has_the_parts_that_its_form_needs(effect):
    inverted = effect.form is Form.MEASURE or (effect.is_static and not effect.of_recording)
    assert (effect.inverse is not None) == inverted
    assert (effect.memory is not None) == (effect.form is Form.FILTER)
    assert set(effect.simpler) | set(effect.becomes) <= set(BY_NAME)
    assert effect.shows_as is None or BY_NAME[effect.shows_as].shows_as is None
    assert set(effect.constants) <= set(BASE)
    if effect.form in (Form.DRY, Form.DRY_RATIO):
        assert effect.place in (Place.CART, Place.POLE)


@every
def test_neutral_is_absent(effect):
    if not effect.parameters:
        pytest.skip("without parameters: on whenever it is there")
    theta = make_theta(Twin("test", THESIS, make_neutral_values(effect)))
    assert not find_active_effects(theta).any()
    assert (
        run(THESIS, COMMAND, make_neutral_values(effect), START).tobytes()
        == run(THESIS, COMMAND, {}, START).tobytes()
    )


@every
def test_with_nothing_of_it_its_shape_does_not_matter(effect):
    if all(p.shape for p in effect.parameters):
        pytest.skip("all of it is shape")
    values = make_neutral_values(effect)[effect.name]
    typical = choose_typical_values(effect)[effect.name]
    values |= {p.name: typical[p.name] for p in effect.parameters if p.shape}
    assert np.array_equal(
        run(THESIS, COMMAND, {effect.name: values}, START),
        run(THESIS, COMMAND, {}, START),
    )


@pytest.mark.parametrize(
    "effect", [e for e in CATALOGUE if e.form is Form.FILTER], ids=lambda e: e.name
)
def test_a_filter_that_is_called_at_neutral_passes_the_command_on(effect):
    on = np.array([e is effect for e in CATALOGUE])
    out = np.empty(2000)
    offsets = np.concatenate([[0], np.cumsum(compute_memory_sizes(1e-3))]).astype(np.int64)
    kernel.filter_command(
        COMMAND, np.zeros(offsets[-1]), offsets, 1e-3, 10, 0, NEUTRAL.copy(), on, out
    )
    assert np.array_equal(out, np.repeat(COMMAND, 10))


@every
def test_changes_the_run_and_leaves_it_finite_and_repeatable(effect):
    # a factor on the dry friction needs some
    others = {"cart_coulomb_friction": {"level_n": 0.5}} if effect.form is Form.DRY_RATIO else {}
    effects = others | choose_typical_values(effect)
    states = run(THESIS, COMMAND, effects, START)
    assert np.all(np.isfinite(states))
    assert states.tobytes() == run(THESIS, COMMAND, effects, START).tobytes()
    assert not np.array_equal(states, run(THESIS, COMMAND, others, START))


@every
def test_is_on_when_it_is_there(effect):
    assert find_active_effects(
        make_theta(Twin("test", THESIS, choose_typical_values(effect)))
    ).tolist() == [e is effect for e in CATALOGUE]


@every
@pytest.mark.parametrize("rig", [CART_ALONE, POLE_ALONE], ids=["cart alone", "pole alone"])
def test_leaves_a_rig_of_one_part_finite(effect, rig):
    states = run(rig, COMMAND, choose_typical_values(effect), START)
    assert np.all(np.isfinite(states))


@every
def test_goes_through_a_twin_file(effect, tmp_path):
    twin = Twin("test", THESIS, choose_typical_values(effect))
    save_twin(twin, tmp_path / "twin.yaml")
    assert load_twin(tmp_path / "twin.yaml") == twin


@every
def test_is_there_at_the_ends_of_its_ranges(effect):
    """No value that a twin file may hold makes the run raise."""
    for end in ("low", "high"):
        values = {p.name: getattr(p, end) for p in effect.parameters}
        run(THESIS, COMMAND[:5], {effect.name: values}, START)


SENSORS = [e for e in CATALOGUE if e.form is Form.MEASURE]


def test_lanes_pass_through_the_sensors_of_their_own_twins():
    """Bit by bit as each lane alone, whatever is on in other lanes."""
    random = np.random.default_rng(3)
    sets = [
        {e.name: {p.name: p.low + 0.6 * (p.high - p.low) for p in e.parameters} for e in chosen}
        for chosen in (SENSORS, SENSORS[:1], SENSORS[3:5], ())
    ]
    theta = np.array([make_theta(Twin("test", THESIS, values)) for values in sets])
    set_of, t = np.array([2, 0, 3, 1, 0, 2]), np.arange(5) * 0.3 + np.arange(6)[:, None]
    states = random.normal(size=(6, 5, 4))
    for convert in (apply_sensors, undo_sensors):
        together = convert(states, theta, t, set_of)
        alone = [
            convert(s[None], theta[[k]], own[None])[0]
            for s, k, own in zip(states, set_of, t, strict=True)
        ]
        assert np.array_equal(together, alone)
        assert not np.array_equal(together[0], states[0])
        assert np.array_equal(together[2], states[2])


@given(
    st.lists(st.sampled_from(SENSORS), unique_by=lambda e: e.name),
    st.tuples(*[st.floats(-50.0, 50.0)] * 4),
    st.floats(0.0, 1.0),
)
def test_un_measuring_gives_back_the_true_state(effects, state, part):
    values = {
        e.name: {p.name: p.low + part * (p.high - p.low) for p in e.parameters} for e in effects
    }
    theta = make_theta(Twin("test", THESIS, values))[None]
    states = np.array([[state]])
    t = np.array([[0.5]])
    np.testing.assert_allclose(
        undo_sensors(apply_sensors(states, theta, t), theta, t), states, rtol=1e-9, atol=1e-9
    )
    np.testing.assert_allclose(
        apply_sensors(undo_sensors(states, theta, t), theta, t), states, rtol=1e-9, atol=1e-9
    )


def test_words_lie_side_by_side():
    covered = sorted(k for slot in SLOTS.values() for k in range(slot.start, slot.stop))
    assert covered == list(range(len(BASE), LAWS))  # measured laws follow
    for effect in CATALOGUE:
        assert tuple(NEUTRAL[SLOTS[effect.name]]) == get_neutral_values(effect)
