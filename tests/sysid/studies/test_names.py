"""The judge of names: made-up seals and answers, and what must come of them."""

import pytest
from support.prove_trials import DRAG, answer, sealed

from pendulum_sysid.studies.proof.judge_trial import make_rival_answer, read_answer
from pendulum_sysid.studies.proof.names import (
    BESIDE,
    NOT_NAMED,
    NOTHING,
    judge_names,
    match_inseparable,
)
from pendulum_sysid.studies.proof.records import Cell, NamesOutcome

COULOMB, DRAG_NAMED, DELAY, LAG = (
    "cart_coulomb_friction",
    "cart_quadratic_drag",
    "input_delay",
    "motor_lag",
)


def how(seal, said) -> NamesOutcome:
    return judge_names(seal, said).how


def test_exactly_the_concealed_names_are_right() -> None:
    assert how(sealed(COULOMB), answer(COULOMB)) is NamesOutcome.RIGHT
    assert how(sealed(COULOMB, DELAY), answer(DELAY, COULOMB)) is NamesOutcome.RIGHT
    assert how(sealed(COULOMB, DELAY), answer(COULOMB)) is NamesOutcome.INCOMPLETE
    assert how(sealed(COULOMB), answer(COULOMB, DELAY)) is NamesOutcome.WRONG
    assert how(sealed(COULOMB), answer(DRAG_NAMED)) is NamesOutcome.WRONG
    assert how(sealed(COULOMB), answer()) is NamesOutcome.MISSED


def test_a_name_is_right_although_the_answer_says_that_it_is_tied() -> None:
    said = answer(COULOMB, outcome="ambiguous", ties={COULOMB: (DRAG_NAMED,)})
    assert how(sealed(COULOMB), said) is NamesOutcome.RIGHT


def test_a_tied_name_excuses_the_one_that_it_takes_the_place_of() -> None:
    said = answer(LAG, outcome="ambiguous", ties={LAG: (DELAY,)})
    found = judge_names(sealed(DELAY), said)
    assert found.how is NamesOutcome.TIED and found.cells == (Cell(DELAY, LAG, tied=True),)
    assert how(sealed(DELAY), answer(LAG)) is NamesOutcome.WRONG


def test_one_entry_excuses_one_effect_only() -> None:
    said = answer(LAG, ties={LAG: (DELAY, COULOMB)})
    assert how(sealed(DELAY, COULOMB), said) is NamesOutcome.INCOMPLETE


def test_an_entry_that_is_there_itself_excuses_nothing() -> None:
    said = answer(LAG, ties={LAG: (DELAY,)})
    assert how(sealed(DELAY, LAG), said) is NamesOutcome.INCOMPLETE


def test_excuses_are_shared_out_so_that_all_have_one() -> None:
    """The first comes away from the entry that it took, for the other has no choice."""
    assert match_inseparable(["a", "b"], {"x": ("a", "b"), "y": ("a",)}) == {"a": "y", "b": "x"}


@pytest.mark.parametrize(
    ("said", "expected"),
    [
        (answer(), NamesOutcome.RIGHT),
        (answer(COULOMB), NamesOutcome.FALSE_ALARM),
        (answer(outcome="not_in_catalogue"), NamesOutcome.FALSE_ALARM),
        (answer(outcome="ambiguous"), NamesOutcome.FALSE_ALARM),
        (answer(outcome="unusable"), NamesOutcome.ABSTAINED),
        (answer(error="ValueError: no"), NamesOutcome.CRASHED),
    ],
)
def test_where_nothing_is_hidden(said, expected) -> None:
    assert how(sealed(), said) is expected


@pytest.mark.parametrize(
    ("said", "expected"),
    [
        (answer(outcome="not_in_catalogue"), NamesOutcome.RIGHT),
        (answer("cart_sign_inverted", outcome="not_in_catalogue"), NamesOutcome.RIGHT),
        (answer("cart_sign_inverted"), NamesOutcome.WRONG),
        (answer(DRAG_NAMED), NamesOutcome.WRONG),
        (answer(DRAG_NAMED, outcome="not_in_catalogue"), NamesOutcome.WRONG),
        (answer(outcome="ambiguous"), NamesOutcome.ABSTAINED),
        (answer(), NamesOutcome.MISSED),
    ],
)
def test_what_the_catalogue_does_not_have(said, expected) -> None:
    assert how(sealed(unlisted=(DRAG,)), said) is expected


def test_place_and_variable_are_judged_apart() -> None:
    said = answer(outcome="not_in_catalogue", place="cart", variables=("time",))
    found = judge_names(sealed(unlisted=(DRAG,)), said)
    assert found.located and not found.depends
    said = answer(outcome="not_in_catalogue", place="pole", variables=("time", "cart_velocity"))
    found = judge_names(sealed(unlisted=(DRAG,)), said)
    assert not found.located and found.depends
    assert judge_names(sealed(COULOMB), answer(COULOMB)).located is None


@pytest.mark.parametrize("outcome", ["not_in_catalogue", "unusable"])
def test_saying_that_one_cannot_tell_is_no_wrong_name(outcome: str) -> None:
    assert how(sealed(COULOMB), answer(outcome=outcome)) is NamesOutcome.ABSTAINED


def test_a_stale_start_is_found_in_the_data_quality() -> None:
    assert how(sealed("stale_start"), answer(stale=True)) is NamesOutcome.RIGHT
    assert how(sealed("stale_start"), answer()) is NamesOutcome.MISSED
    assert how(sealed("stale_start", COULOMB), answer(COULOMB, stale=True)) is NamesOutcome.RIGHT
    assert how(sealed("stale_start"), answer("stale_start", stale=True)) is NamesOutcome.RIGHT
    assert how(sealed(COULOMB), answer(COULOMB, stale=True)) is NamesOutcome.RIGHT


def test_who_was_taken_for_whom() -> None:
    """A wrong name stands for what is missing at its place; what is left over stands for nothing."""
    said = answer(LAG, DRAG_NAMED, "rail_tilt")
    cells = judge_names(sealed(COULOMB, LAG, "pole_spring"), said).cells
    assert set(cells) == {
        Cell(LAG, LAG),
        Cell(COULOMB, DRAG_NAMED),
        Cell("pole_spring", "rail_tilt"),
    }
    assert judge_names(sealed(COULOMB), answer(COULOMB, LAG)).cells == (
        Cell(COULOMB, COULOMB),
        Cell(BESIDE, LAG),
    )
    assert judge_names(sealed(COULOMB), answer()).cells == (Cell(COULOMB, NOT_NAMED),)
    assert judge_names(sealed(), answer(LAG)).cells == (Cell(NOTHING, LAG),)
    assert judge_names(sealed(), answer()).cells == (Cell(NOTHING, NOT_NAMED),)


def test_a_verdict_is_read_as_an_answer() -> None:
    verdict = {
        "outcome": "ambiguous",
        "location": {
            "place": "cart",
            "evidence": [{"variable": "cart_velocity", "finding": "", "share": 0.9}],
        },
        "missing_physics": [{"effect": COULOMB, "cannot_be_told_from": [DRAG_NAMED]}],
        "data_quality": [{"kind": "stale", "count": 3, "intervals_s": []}],
    }
    found = read_answer(verdict)
    assert (found.outcome, found.place, found.variables, found.stale) == (
        "ambiguous",
        "cart",
        ("cart_velocity",),
        True,
    )
    assert found.named == {COULOMB: (DRAG_NAMED,)}
    assert read_answer({}, "broke").error == "broke"


def test_a_rival_is_excused_where_no_motion_can_tell() -> None:
    assert how(sealed("sensor_delay"), make_rival_answer(["input_delay"])) is NamesOutcome.TIED
    assert how(sealed("motor_lag"), make_rival_answer(["input_delay"])) is NamesOutcome.WRONG
    assert how(sealed(), make_rival_answer([])) is NamesOutcome.RIGHT
