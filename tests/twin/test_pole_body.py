"""Rigs that no bodies make are refused, with the number that probably means something else."""

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.twin_rigs import CART, POLE, POLE_ALONE, THESIS

from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin, parse_twin
from pendulum_twin.parameter_vector import BASE, make_theta
from pendulum_twin.pole_body import check_pole_body, move_mass_to_pole
from pendulum_twin.rig import Rig

POLE_COM_M = THESIS.moment_kg_m / POLE["pole_mass_kg"]
ABOUT_CENTRE = POLE["pole_inertia_kg_m2"] - POLE["pole_mass_kg"] * POLE_COM_M**2
HEAVIER_THAN_ITS_POLE = {"pole_inertia_kg_m2": 0.0014}  # definite; the pole's own share is 0.92


def read(rig: dict[str, float]) -> Twin:
    return parse_twin({"schema": "pendulum_twin/1", "rig": rig})


def get_refusal(rig: dict[str, float]) -> str:
    with pytest.raises(BadInputError) as error:
        read(rig)
    return str(error.value)


def test_com_distance_of_the_pole_alone_is_refused_and_named() -> None:
    sentence = get_refusal({**CART, **POLE, "com_distance_m": POLE_COM_M})
    assert sentence.startswith("pole_inertia_kg_m2: expected more than 0.00881")
    for phrase in ("cart_mass_kg 0.5723", "pole_mass_kg 0.12", "com_distance_m 0.1128"):
        assert phrase in sentence
    assert "found 0.00292" in sentence
    assert "com_distance_m is probably that of the pole alone" in sentence
    assert "give it as pole_com_distance_m" in sentence


def test_giving_it_as_the_sentence_says_mends_it() -> None:
    pole = {key: value for key, value in POLE.items() if key != "com_distance_m"}
    twin = read({**CART, **pole, "pole_com_distance_m": POLE_COM_M})
    assert twin.rig.com_distance_m == pytest.approx(THESIS.com_distance_m)


def test_the_inertia_about_the_centre_of_mass_is_refused_and_named() -> None:
    sentence = get_refusal({**CART, **POLE, "pole_inertia_kg_m2": ABOUT_CENTRE})
    assert "expected at least 0.001528 for a pole of 0.12 kg" in sentence
    assert "centre of mass 0.1128 m from the axis" in sentence
    assert "found 0.00139" in sentence
    assert "probably about the centre of mass: about the axis it would be 0.00292" in sentence
    assert "com_distance_m is probably" not in sentence


def test_the_same_with_the_distance_of_the_pole_alone() -> None:
    pole = {key: value for key, value in POLE.items() if key != "com_distance_m"}
    sentence = get_refusal(
        {**CART, **pole, "pole_com_distance_m": POLE_COM_M, "pole_inertia_kg_m2": 1e-4}
    )
    assert "pole_inertia_kg_m2 is probably about the centre of mass" in sentence
    assert "com_distance_m is probably" not in sentence


def test_a_pole_alone_with_the_inertia_of_a_rod_about_its_centre_is_refused() -> None:
    rod = {"pole_mass_kg": 0.12, "com_distance_m": 0.3, "pole_viscous_n_m_s": 0.0}
    about_axis = 0.12 * 0.3**2 * 4 / 3
    sentence = get_refusal({**rod, "pole_inertia_kg_m2": about_axis / 4})
    assert f"about the axis it would be {about_axis:.4g}" in sentence
    read({**rod, "pole_inertia_kg_m2": about_axis})


@pytest.mark.parametrize("cart", [{}, CART], ids=["pole_alone", "cart_and_pole"])
def test_a_point_at_the_end_of_a_thread_is_a_pole(cart: dict[str, float]) -> None:
    """Its inertia is the least there is, up to the rounding of three digits."""
    pole = {"pole_mass_kg": 0.1, "pole_com_distance_m": 0.333, "pole_viscous_n_m_s": 0.0}
    read({**cart, **pole, "pole_inertia_kg_m2": 0.1 * 0.333**2})
    read({**cart, **pole, "pole_inertia_kg_m2": 0.011})


def test_no_rig_with_an_indefinite_mass_matrix_can_be_made() -> None:
    least = THESIS.moment_kg_m**2 / THESIS.total_mass_kg
    with pytest.raises(BadInputError, match="no bodies move like that"):
        replace(THESIS, pole_inertia_kg_m2=least)
    replace(THESIS, pole_inertia_kg_m2=1.0001 * least)


def test_a_rig_may_be_made_with_a_pole_that_is_too_light() -> None:
    """A fit, a draw: motion does not show how the mass divides. A file with it is refused."""
    rig = replace(THESIS, **HEAVIER_THAN_ITS_POLE)
    with pytest.raises(BadInputError, match="expected at least"):
        check_pole_body(rig)


def test_mass_from_the_cart_makes_it_a_pole_and_changes_no_motion() -> None:
    rig = replace(THESIS, **HEAVIER_THAN_ITS_POLE)
    moved = move_mass_to_pole(rig)
    check_pole_body(moved)
    assert moved.pole_mass_kg == pytest.approx(THESIS.moment_kg_m**2 / 0.0014)
    base = slice(0, len(BASE))
    assert make_theta(Twin("a", moved))[base] == pytest.approx(make_theta(Twin("b", rig))[base])


@pytest.mark.parametrize("rig", [THESIS, POLE_ALONE, Rig(**CART)])
def test_mass_stays_where_bodies_exist(rig: Rig) -> None:
    assert move_mass_to_pole(rig) is rig


@given(
    cart=st.floats(0.01, 10.0),
    pole=st.floats(0.01, 10.0),
    distance=st.floats(0.0, 2.0),
    inertia=st.floats(1e-6, 10.0),
)
def test_every_rig_has_a_mass_matrix_with_two_positive_eigenvalues(
    cart: float, pole: float, distance: float, inertia: float
) -> None:
    try:
        rig = replace(
            THESIS,
            cart_mass_kg=cart,
            pole_mass_kg=pole,
            com_distance_m=distance,
            pole_inertia_kg_m2=inertia,
        )
    except BadInputError as error:
        assert "no bodies move like that" in str(error)
        assert (cart + pole) * inertia <= ((cart + pole) * distance) ** 2 * (1 + 1e-12)
        return
    moved = move_mass_to_pole(rig)
    check_pole_body(moved)
    assert moved.cart_mass_kg > 0.0 and math.isclose(moved.total_mass_kg, rig.total_mass_kg)
