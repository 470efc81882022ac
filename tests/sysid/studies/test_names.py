"""The judge of names: made-up seals and answers, and the outcome that must follow."""

import subprocess
import sys

import pytest
from support.prove_trials import DRAG, make_answer, make_seal

from pendulum_sysid.records import Outcome
from pendulum_sysid.studies.proof import names
from pendulum_sysid.studies.proof.answers import make_rival_answer, read_answer
from pendulum_sysid.studies.proof.names import (
    BESIDE,
    NOT_NAMED,
    NOTHING,
    describe_cell,
    judge_names,
    match_inseparable,
)
from pendulum_sysid.studies.proof.records import Cell, NamesOutcome, Seal, TrialAnswer
from pendulum_twin.errors import BadInputError

COULOMB, QUADRATIC, DELAY, LAG = (
    "cart_coulomb_friction",
    "cart_quadratic_drag",
    "input_delay",
    "motor_lag",
)


def judge_outcome(seal: Seal, answer: TrialAnswer) -> NamesOutcome:
    return judge_names(seal, answer).outcome


def test_exactly_the_concealed_names_are_right() -> None:
    seal, pair = make_seal(COULOMB), make_seal(COULOMB, DELAY)
    assert judge_outcome(seal, make_answer(COULOMB)) is NamesOutcome.RIGHT
    assert judge_outcome(pair, make_answer(DELAY, COULOMB)) is NamesOutcome.RIGHT
    assert judge_outcome(pair, make_answer(COULOMB)) is NamesOutcome.INCOMPLETE
    assert judge_outcome(seal, make_answer(COULOMB, DELAY)) is NamesOutcome.WRONG
    assert judge_outcome(seal, make_answer(QUADRATIC)) is NamesOutcome.WRONG
    assert judge_outcome(seal, make_answer()) is NamesOutcome.MISSED


def test_a_name_is_right_although_the_answer_says_that_it_is_tied() -> None:
    answer = make_answer(COULOMB, outcome="ambiguous", ties={COULOMB: (QUADRATIC,)})
    assert judge_outcome(make_seal(COULOMB), answer) is NamesOutcome.RIGHT


def test_a_tied_name_excuses_the_effect_whose_place_it_takes() -> None:
    answer = make_answer(LAG, outcome="ambiguous", ties={LAG: (DELAY,)})
    judgement = judge_names(make_seal(DELAY), answer)
    assert judgement.outcome is NamesOutcome.TIED
    assert judgement.cells == (Cell(DELAY, LAG, tied=True),)
    assert judge_outcome(make_seal(DELAY), make_answer(LAG)) is NamesOutcome.WRONG


def test_a_name_excuses_a_single_effect() -> None:
    answer = make_answer(LAG, ties={LAG: (DELAY, COULOMB)})
    assert judge_outcome(make_seal(DELAY, COULOMB), answer) is NamesOutcome.INCOMPLETE


def test_a_concealed_name_excuses_nothing() -> None:
    answer = make_answer(LAG, ties={LAG: (DELAY,)})
    assert judge_outcome(make_seal(DELAY, LAG), answer) is NamesOutcome.INCOMPLETE


def test_a_tie_does_not_cover_another_wrong_name() -> None:
    """The names are as many as the concealed effects, and every effect is named or tied."""
    answer = make_answer(LAG, QUADRATIC, ties={LAG: (DELAY,)})
    assert judge_outcome(make_seal(DELAY, LAG), answer) is NamesOutcome.WRONG


def test_names_are_shared_out_so_that_all_effects_have_theirs() -> None:
    assert match_inseparable(["a", "b"], {"x": ("a", "b"), "y": ("a",)}) == {"a": "y", "b": "x"}
    assert match_inseparable(["a", "b"], {"x": ("c",)}) == {}
    assert match_inseparable([], {"x": ("a",)}) == match_inseparable(["a"], {}) == {}


@pytest.mark.parametrize(
    ("answer", "expected"),
    [
        (make_answer(), NamesOutcome.RIGHT),
        (make_answer(COULOMB), NamesOutcome.FALSE_ALARM),
        (make_answer(outcome="not_in_catalogue"), NamesOutcome.FALSE_ALARM),
        (make_answer(outcome="ambiguous"), NamesOutcome.FALSE_ALARM),
        (make_answer(outcome="unusable"), NamesOutcome.ABSTAINED),
        (make_answer(error="ValueError: no"), NamesOutcome.CRASHED),
    ],
)
def test_where_nothing_is_hidden(answer: TrialAnswer, expected: NamesOutcome) -> None:
    assert judge_outcome(make_seal(), answer) is expected


@pytest.mark.parametrize(
    ("answer", "expected"),
    [
        (make_answer(outcome="not_in_catalogue"), NamesOutcome.RIGHT),
        (make_answer("cart_sign_inverted", outcome="not_in_catalogue"), NamesOutcome.RIGHT),
        (make_answer("cart_sign_inverted"), NamesOutcome.WRONG),
        (make_answer(QUADRATIC), NamesOutcome.WRONG),
        (make_answer(QUADRATIC, outcome="not_in_catalogue"), NamesOutcome.WRONG),
        (make_answer(outcome="ambiguous"), NamesOutcome.ABSTAINED),
        (make_answer(), NamesOutcome.MISSED),
    ],
)
def test_what_the_catalogue_does_not_have(answer: TrialAnswer, expected: NamesOutcome) -> None:
    assert judge_outcome(make_seal(unlisted=(DRAG,)), answer) is expected


def test_place_and_variable_are_judged_apart() -> None:
    seal = make_seal(unlisted=(DRAG,))
    answer = make_answer(outcome="not_in_catalogue", place="cart", variables=("time",))
    judgement = judge_names(seal, answer)
    assert judgement.located and not judgement.depends
    variables = ("time", "cart_velocity*time")
    answer = make_answer(outcome="not_in_catalogue", place="pole", variables=variables)
    judgement = judge_names(seal, answer)
    assert not judgement.located and judgement.depends
    assert judge_names(make_seal(COULOMB), make_answer(COULOMB)).located is None


@pytest.mark.parametrize("outcome", ["not_in_catalogue", "unusable"])
def test_an_answer_that_it_cannot_tell_is_no_wrong_name(outcome: str) -> None:
    answer = make_answer(outcome=outcome)
    assert judge_outcome(make_seal(COULOMB), answer) is NamesOutcome.ABSTAINED


def test_a_stale_start_is_found_in_the_data_quality() -> None:
    stale = make_seal("stale_start")
    for seal, answer, expected in (
        (stale, make_answer(stale=True), NamesOutcome.RIGHT),
        (stale, make_answer(), NamesOutcome.MISSED),
        (
            make_seal("stale_start", COULOMB),
            make_answer(COULOMB, stale=True),
            NamesOutcome.RIGHT,
        ),
        (stale, make_answer("stale_start", stale=True), NamesOutcome.RIGHT),
        (make_seal(COULOMB), make_answer(COULOMB, stale=True), NamesOutcome.RIGHT),
    ):
        assert judge_outcome(seal, answer) is expected


def test_which_effect_was_taken_for_which() -> None:
    """A wrong name stands for a lost effect of its place; other names stand for nothing."""
    answer = make_answer(LAG, QUADRATIC, "rail_tilt")
    cells = judge_names(make_seal(COULOMB, LAG, "pole_spring"), answer).cells
    assert set(cells) == {
        Cell(LAG, LAG),
        Cell(COULOMB, QUADRATIC),
        Cell("pole_spring", "rail_tilt"),
    }
    for seal, answer, expected in (
        (
            make_seal(COULOMB),
            make_answer(COULOMB, LAG),
            (Cell(COULOMB, COULOMB), Cell(BESIDE, LAG)),
        ),
        (make_seal(COULOMB), make_answer(), (Cell(COULOMB, NOT_NAMED),)),
        (make_seal(), make_answer(LAG), (Cell(NOTHING, LAG),)),
        (make_seal(), make_answer(), (Cell(NOTHING, NOT_NAMED),)),
    ):
        assert judge_names(seal, answer).cells == expected


def test_a_cell_is_described_for_a_person() -> None:
    assert describe_cell(Cell(LAG, LAG)) == "named"
    assert describe_cell(Cell(DELAY, NOT_NAMED)) == "not named"
    assert describe_cell(Cell(BESIDE, LAG)) == "not concealed"
    assert describe_cell(Cell(DELAY, LAG, tied=True)).startswith("not named, but motor_lag")
    assert all(outcome.sentence.endswith(".") for outcome in NamesOutcome)


def test_a_verdict_is_read_as_an_answer() -> None:
    verdict = {
        "outcome": "ambiguous",
        "location": {
            "place": "cart",
            "evidence": [{"variable": "cart_velocity", "finding": "", "share": 0.9}],
        },
        "missing_physics": [{"effect": COULOMB, "cannot_be_told_from": [QUADRATIC]}],
        "data_quality": [{"kind": "stale", "count": 3, "intervals_s": []}],
    }
    assert read_answer(verdict) == TrialAnswer(
        "ambiguous", {COULOMB: (QUADRATIC,)}, True, "cart", ("cart_velocity",)
    )
    assert read_answer({}, "broke").error == "broke"


@pytest.mark.parametrize("entry", [{"effect": COULOMB}, "cart_coulomb_friction"])
def test_an_odd_verdict_is_refused(entry: object) -> None:
    with pytest.raises(BadInputError, match="verdict: expected the entries of"):
        read_answer({"missing_physics": [entry]})


def test_a_rival_is_excused_where_no_motion_can_tell() -> None:
    delay = make_rival_answer(["input_delay"])
    assert judge_outcome(make_seal("sensor_delay"), delay) is NamesOutcome.TIED
    assert judge_outcome(make_seal("motor_lag"), delay) is NamesOutcome.WRONG
    assert judge_outcome(make_seal(), make_rival_answer([])) is NamesOutcome.RIGHT


def test_the_judge_reads_outcomes_as_verdicts_write_them() -> None:
    assert Outcome.NOTHING_MISSING.value == names.NOTHING_MISSING
    assert Outcome.NOT_IN_CATALOGUE.value == names.NOT_IN_CATALOGUE
    assert Outcome.UNUSABLE.value == names.UNUSABLE


def test_the_judge_is_light_to_import() -> None:
    code = "import sys, pendulum_sysid.studies.proof.names; print(*sys.modules)"
    result = subprocess.run(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, check=True
    )
    assert {"numba", "torch", "matplotlib"}.isdisjoint(result.stdout.split())
