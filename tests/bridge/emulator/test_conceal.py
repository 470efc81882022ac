"""What a seed conceals, and the sealed file it is kept in."""

import json

import pytest

from pendulum_bridge.emulator.conceal import (
    PERTURBED_CONSTANTS,
    complete_set,
    conceal_effects,
    draw_concealed,
)
from pendulum_bridge.emulator.concealable import BY_NAME, TABLE
from pendulum_bridge.emulator.seal import Concealed, open_seal, write_seal
from pendulum_twin.effects import BY_NAME as CATALOGUE
from pendulum_twin.errors import BadInputError
from pendulum_twin.rig import Rig


def test_names_and_parameters_are_the_catalogues() -> None:
    for effect in TABLE:
        assert set(effect.sizes) == {p.name for p in CATALOGUE[effect.name].parameters}


def test_the_same_seed_conceals_the_same(nominal: Rig) -> None:
    assert draw_concealed(7, 2, nominal) == draw_concealed(7, 2, nominal)
    assert draw_concealed(7, 2, nominal) != draw_concealed(8, 2, nominal)


@pytest.mark.parametrize("seed", range(40))
def test_draws_are_realistic(seed: int, nominal: Rig) -> None:
    concealed = draw_concealed(seed, 3, nominal)
    assert len(concealed.effects) == 3
    assert len({BY_NAME[name].family for name in concealed.effects}) == 3
    for name, values in concealed.effects.items():
        for key, (low, high) in BY_NAME[name].sizes.items():
            size = abs(values[key]) if BY_NAME[name].both_ways else values[key]
            assert low <= size <= high
    for key, value in nominal.to_mapping().items():
        ratio = getattr(concealed.rig, key) / value
        assert 0.8 <= ratio <= 1.2 and (key in PERTURBED_CONSTANTS or ratio == 1)


def test_every_effect_is_drawn_sometime(nominal: Rig) -> None:
    alone = {name for seed in range(300) for name in draw_concealed(seed, 1, nominal).effects}
    assert alone == {effect.name for effect in TABLE if not effect.beside}
    assert {
        name for seed in range(300) for name in draw_concealed(seed, 2, nominal).effects
    } == set(BY_NAME)


@pytest.mark.parametrize("count", [2, 3])
def test_what_needs_another_beside_it_has_it(count: int, nominal: Rig) -> None:
    for first in (effect for effect in TABLE if effect.beside):
        for seed in range(20):
            names = complete_set([first.name], count, seed)
            assert len(names) == count and set(names) & set(first.beside)


def test_a_live_rig_comes_to_rest_and_counts_nothing_from_a_recordings_beginning(
    nominal: Rig,
) -> None:
    drawn = {
        name for seed in range(300) for name in draw_concealed(seed, 2, nominal, live=True).effects
    }
    assert drawn == {effect.name for effect in TABLE if effect.is_of_live_rig}
    assert not {"stale_start", "periodic_force", "gain_drift", "friction_warming"} & drawn


def test_a_size_factor_brings_sizes_towards_neutral_and_leaves_the_rest(nominal: Rig) -> None:
    names = (
        "input_saturation",
        "cart_stribeck_friction",
        "rail_spring",
        "angle_offset",
        "encoder_slip",
    )
    full, half = conceal_effects(names, 5, nominal), conceal_effects(names, 5, nominal, 0.5)
    assert full.rig == half.rig
    for name in names:
        for key, value in full.effects[name].items():
            shape, neutral = key in BY_NAME[name].shapes, BY_NAME[name].neutral
            assert half.effects[name][key] == pytest.approx(
                value if shape else neutral + 0.5 * (value - neutral)
            )


def test_nothing_can_be_concealed_too(nominal: Rig) -> None:
    concealed = draw_concealed(1, 0, nominal)
    assert concealed.effects == {} and concealed.rig != nominal


def test_too_many_are_refused(nominal: Rig) -> None:
    with pytest.raises(BadInputError, match="effects: expected a number from 0 to"):
        draw_concealed(1, 99, nominal)


def test_a_seal_opens_to_what_was_sealed(nominal: Rig, tmp_path) -> None:
    concealed = draw_concealed(11, 2, nominal)
    write_seal(concealed, tmp_path / "seal.json")
    assert open_seal(tmp_path / "seal.json") == concealed
    content = json.loads((tmp_path / "seal.json").read_text())
    assert (
        set(content) == {"schema", "effects", "unlisted", "rig"}
        and content["schema"] == "pendulum_seal/1"
    )


@pytest.mark.parametrize(
    "text", ["", "[]", '{"schema": "pendulum_seal/2", "effects": {}, "rig": {}}']
)
def test_what_is_no_seal_is_refused(text: str, tmp_path) -> None:
    (tmp_path / "seal.json").write_text(text)
    with pytest.raises(BadInputError, match="expected a seal"):
        open_seal(tmp_path / "seal.json")


def test_an_effect_that_no_catalogue_has_cannot_be_sealed(nominal: Rig) -> None:
    with pytest.raises(BadInputError, match="unknown effect ghost"):
        Concealed({"ghost": {}}, nominal)


@pytest.mark.parametrize(("seed", "count"), [(296, 3), (31402, 4)])
def test_a_set_that_ends_in_nothing_is_begun_otherwise(seed: int, count: int) -> None:
    """The effects first in the order leave no room for what one of them needs beside it."""
    assert len(set(complete_set((), count, seed))) == count
