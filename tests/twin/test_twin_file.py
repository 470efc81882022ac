"""Twin files: what goes in comes out, and whatever is wrong is refused by name."""

import copy
from pathlib import Path

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from support.twin_rigs import CART_ALONE, POLE_ALONE, THESIS

from pendulum_twin.effects import BY_NAME, CATALOGUE
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin, load_twin, parse_twin, save_twin
from pendulum_twin.parameter_vector import SLOTS, make_theta
from pendulum_twin.rig import RANGES, UNITS, Rig

GOOD = {
    "schema": "pendulum_twin/1",
    "name": "inteco",
    "rig": THESIS.to_mapping(),
    "effects": {"cart_coulomb_friction": {"level_n": 1.2}, "input_sign_inverted": {}},
}


def change(*path_and_value):
    """Return a good file's mapping with one place changed; a value of None takes the key away."""
    mapping = copy.deepcopy(GOOD)
    *path, key, value = path_and_value
    place = mapping
    for name in path:
        place = place[name]
    if value is None:
        del place[key]
    else:
        place[key] = value
    return mapping


def assert_refused(mapping, *phrases):
    """Check that a file is refused in a sentence with all these phrases."""
    with pytest.raises(BadInputError) as error:
        parse_twin(mapping)
    for phrase in phrases:
        assert phrase in str(error.value)


def test_a_good_file_is_read():
    twin = parse_twin(GOOD)
    assert (twin.name, twin.rig) == ("inteco", THESIS)
    assert twin.effects == {"cart_coulomb_friction": {"level_n": 1.2}, "input_sign_inverted": {}}
    assert twin.to_mapping() == GOOD


def test_an_effect_without_parameters_may_be_left_empty():
    text = yaml.safe_dump(GOOD | {"effects": {}}).replace("{}", "{angle_sign_inverted: }")
    twin = parse_twin(yaml.safe_load(text))
    assert twin.effects == {"angle_sign_inverted": {}}
    assert make_theta(twin)[SLOTS["angle_sign_inverted"]] == [1.0]


@pytest.mark.parametrize("key", RANGES)
def test_each_number_of_the_rig_is_checked(key):
    low, high = RANGES[key]
    assert_refused(change("rig", key, 2 * high), key, f"{low:g} to {high:g}")
    assert_refused(change("rig", key, -1.0), key, "-1.0")
    assert_refused(change("rig", key, float("nan")), key, "nan")
    assert_refused(change("rig", key, float("inf")), key, "inf")
    assert_refused(change("rig", key, 10**400), key, "found 1000")
    assert_refused(change("rig", key, True), key, "expected a number", "True")
    assert_refused(change("rig", key, "0.5 kg"), key, "expected a number", "0.5 kg")


@pytest.mark.parametrize("effect", CATALOGUE, ids=lambda e: e.name)
def test_each_number_of_an_effect_is_checked(effect):
    middle = {p.name: min(max(p.neutral, p.low), p.high) for p in effect.parameters}
    assert_refused(
        change("effects", effect.name, middle | {"strength": 1.0}), effect.name, "strength"
    )
    assert_refused(change("effects", effect.name, [1.0]), effect.name, "expected a mapping")
    for p in effect.parameters:
        for bad in (p.high * 2 + 1, p.low - 1, float("nan"), float("inf"), True, "1"):
            assert_refused(
                change("effects", effect.name, middle | {p.name: bad}), effect.name, p.name
            )
        missing = {name: value for name, value in middle.items() if name != p.name}
        if p.optional:
            filled = parse_twin(change("effects", effect.name, missing)).effects[effect.name]
            assert filled == middle
            continue
        assert_refused(change("effects", effect.name, missing), effect.name, p.name, "missing")


def test_unknown_names_are_refused_with_a_hint():
    assert_refused(
        change("rig", "cart_mass_g", 572.3), "cart_mass_g", "did you mean cart_mass_kg", "unit"
    )
    assert_refused(change("rig", "wheel_count", 4), "wheel_count", "known are", "cart_mass_kg")
    assert_refused(
        change("effects", "cart_coulomb_friction", {"level_mn": 1200}), "level_mn", "level_n"
    )
    assert_refused(change("effects", "cart_rust", {}), "cart_rust", "cart_coulomb_friction")
    assert_refused(change("colour", "red"), "colour")


def test_other_shapes_are_refused():
    assert_refused(None, "expected a mapping")
    assert_refused([1, 2], "expected a mapping", "found [1, 2]")
    assert_refused(change("schema", "pendulum_twin/2"), "pendulum_twin/1", "pendulum_twin/2")
    assert_refused(change("schema", None), "pendulum_twin/1")
    assert_refused(change("rig", None), "rig", "mapping")
    assert_refused(change("rig", "inteco"), "rig", "found 'inteco'")
    assert_refused(change("effects", ["rail_tilt"]), "effects", "found ['rail_tilt']")


def test_a_part_is_whole_or_absent():
    assert_refused(
        change("rig", "cart_viscous_n_s_m", None), "all keys of the cart", "cart_viscous_n_s_m"
    )
    assert_refused(
        change("rig", "pole_inertia_kg_m2", None), "all keys of the pole", "pole_inertia_kg_m2"
    )
    with pytest.raises(BadInputError, match=r"expected a cart .* or a pole"):
        Rig()


def test_rigs_of_one_part():
    assert CART_ALONE.has_cart
    assert not CART_ALONE.has_pole
    assert POLE_ALONE.has_pole
    assert not POLE_ALONE.has_cart
    assert not set(CART_ALONE.to_mapping()) & {"pole_mass_kg", "com_distance_m"}
    assert CART_ALONE.total_mass_kg == CART_ALONE.cart_mass_kg


def test_every_number_of_the_rig_has_a_unit():
    assert set(UNITS) == set(RANGES) == set(Rig.__dataclass_fields__)


def give_pole_distance(distance_m, **changes):
    """Return a good file's mapping with the pole's own distance and other changes of the rig."""
    rig = {key: value for key, value in GOOD["rig"].items() if key != "com_distance_m"} | changes
    rig = {key: value for key, value in rig.items() if value is not None}
    return GOOD | {"rig": {**rig, "pole_com_distance_m": distance_m}}


def test_the_centre_of_mass_may_be_that_of_the_pole_alone():
    twin = parse_twin(give_pole_distance(0.12, pole_mass_kg=0.1, cart_mass_kg=0.5))
    assert twin.rig.com_distance_m == pytest.approx(0.1 * 0.12 / 0.6)
    moment = twin.rig.total_mass_kg * twin.rig.com_distance_m
    assert moment == pytest.approx(0.1 * 0.12)


def test_the_centre_of_mass_of_a_pole_without_a_cart_is_its_own():
    rig = POLE_ALONE.to_mapping() | {"com_distance_m": None}
    rig = {key: value for key, value in rig.items() if value is not None}
    twin = parse_twin(GOOD | {"rig": {**rig, "pole_com_distance_m": 0.12}, "effects": {}})
    assert twin.rig.com_distance_m == 0.12


def test_a_written_file_holds_the_centre_of_mass_of_cart_and_pole(tmp_path):
    twin = parse_twin(give_pole_distance(0.12))
    save_twin(twin, tmp_path / "twin.yaml")
    rig = yaml.safe_load((tmp_path / "twin.yaml").read_text())["rig"]
    assert "pole_com_distance_m" not in rig
    assert rig["com_distance_m"] == twin.rig.com_distance_m
    assert load_twin(tmp_path / "twin.yaml") == twin


def test_the_centre_of_mass_is_given_once_and_checked_like_any_number():
    both = change("rig", "pole_com_distance_m", 0.12)
    assert_refused(both, "com_distance_m", "pole_com_distance_m", "found both", "give one of them")
    for bad in (-0.1, 101.0, float("nan"), "12 cm", True):
        assert_refused(give_pole_distance(bad), "pole_com_distance_m: expected a number")
    lone = give_pole_distance(0.12, pole_mass_kg=None)
    assert_refused(lone, "pole_com_distance_m: expected pole_mass_kg beside it")
    assert_refused(give_pole_distance(0.12, pole_mass_kg="heavy"), "pole_mass_kg")
    assert_refused(give_pole_distance(0.12, cart_mass_kg=-1.0), "cart_mass_kg")
    assert_refused(change("rig", "pole_com_distance_mm", 120), "did you mean pole_com_distance_m")


def draw_effects():
    """Return a strategy for the effects of a twin, with any values in their ranges."""

    def draw_parameters(effect):
        return st.fixed_dictionaries(
            {p.name: st.floats(p.low, p.high, allow_subnormal=False) for p in effect.parameters}
        )

    return st.lists(st.sampled_from(CATALOGUE), unique_by=lambda e: e.name).flatmap(
        lambda chosen: st.fixed_dictionaries({e.name: draw_parameters(e) for e in chosen})
    )


@given(
    draw_effects(),
    st.text(st.characters(codec="utf-8", exclude_categories=["Cc", "Cs"]), max_size=20),
)
def test_a_file_gives_back_the_very_twin(tmp_path_factory, effects, name):
    path = tmp_path_factory.mktemp("twins") / "twin.yaml"
    for rig in (THESIS, CART_ALONE, POLE_ALONE):
        twin = Twin(name, rig, effects)
        save_twin(twin, path)
        assert load_twin(path) == twin


def test_files_that_cannot_be_read_are_refused_by_their_path(tmp_path):
    path = tmp_path / "twin.yaml"
    for content, word in (
        (b"rig: [", "expected YAML"),
        (b"\xff\xfe\x00", "cannot be read"),
        (b"", "expected a twin file, found it empty"),
    ):
        path.write_bytes(content)
        with pytest.raises(BadInputError, match=word) as error:
            load_twin(path)
        assert str(path) in str(error.value)
    with pytest.raises(BadInputError, match="cannot be read"):
        load_twin(tmp_path / "nowhere.yaml")
    with pytest.raises(BadInputError, match="cannot be read"):
        load_twin(tmp_path)


def test_a_twin_is_written_whole_or_not_at_all(tmp_path, monkeypatch):
    path = tmp_path / "new folder" / "twin.yaml"
    save_twin(parse_twin(GOOD), path)
    before = path.read_text()

    def fail(*_):
        raise OSError("disk full")

    monkeypatch.setattr(Path, "replace", fail)
    with pytest.raises(OSError, match="disk full"):
        save_twin(parse_twin(change("name", "other")), path)
    assert path.read_text() == before
    assert [p.name for p in path.parent.iterdir()] == ["twin.yaml"]


def test_the_catalogue_has_each_name_once():
    assert len(BY_NAME) == len(CATALOGUE)
