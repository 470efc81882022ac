"""Two recordings of a rig: agreement of names, overlap of intervals, the twin on the other."""

from dataclasses import replace

import pytest
from support.prove_trials import make_answer, make_judgement, make_seal, make_size, make_trial

from pendulum_sysid.studies.proof.judge_pair import agree_in_names, judge_pair
from pendulum_sysid.studies.proof.names import count_names, judge_names
from pendulum_sysid.studies.proof.records import (
    NameCounts,
    NamesOutcome,
    PairJudgement,
    Seal,
    UnlistedEffect,
)
from pendulum_sysid.studies.proof.share import Share
from pendulum_sysid.studies.proof.statistics import count_pairs
from pendulum_sysid.studies.proof.targets import NO_TARGET, WITHOUT_REST, check_targets

COULOMB, DELAY, LAG = "cart_coulomb_friction", "input_delay", "motor_lag"
TRUTH = Seal({COULOMB: {"level_n": 0.5}}, make_seal().rig)


def make_second(value: float, half: float, given: float = 30.0) -> dict:
    entry = {
        "effect": COULOMB,
        "cannot_be_told_from": [],
        "parameters": {
            "level_n": {"value": value, "low": value - half, "high": value + half, "unit": "N"}
        },
    }
    verdict = {"outcome": "named", "missing_physics": [entry], "data_quality": []}
    return {"verdict": verdict, "error": "", "given": given}


@pytest.mark.parametrize(
    ("a", "b", "agree"),
    [
        (make_answer(COULOMB), make_answer(COULOMB), True),
        (make_answer(), make_answer(), True),
        (make_answer(COULOMB), make_answer(), False),
        (make_answer(COULOMB), make_answer(COULOMB, DELAY), False),
        (make_answer(LAG, ties={LAG: (DELAY,)}), make_answer(DELAY), True),
        (make_answer(DELAY), make_answer(LAG, ties={LAG: (DELAY,)}), True),
        (make_answer(LAG), make_answer(DELAY), False),
        (make_answer(COULOMB, error="crash"), make_answer(COULOMB), False),
    ],
)
def test_names_agree_up_to_their_own_ties(a, b, agree: bool) -> None:
    assert agree_in_names(a, b) is agree and agree_in_names(b, a) is agree


def test_intervals_and_scores_of_both_are_compared() -> None:
    first = make_answer(COULOMB), (make_size(0.5, 0.52, 0.05),)
    near = judge_pair(TRUTH, first, make_second(0.48, 0.05), 12.0, 1.0)
    far = judge_pair(TRUTH, first, make_second(0.40, 0.05, given=10.0), 12.0, 1.0)
    assert near.agree and near.overlapping == 1 and near.is_better
    assert near.sizes[0].inside and not far.sizes[0].inside
    assert far.overlapping == 0 and not far.is_better


def test_shares_are_counted_over_all_pairs() -> None:
    first = make_answer(COULOMB), (make_size(0.5, 0.52, 0.05),)
    trial = replace(make_trial(COULOMB), seal=TRUTH)
    judged = [
        make_judgement(
            trial,
            first[0],
            sizes=first[1],
            pair=judge_pair(TRUTH, first, make_second(value, 0.05), 12.0, 1.0),
        )
        for value in (0.48, 0.40)
    ]
    pairs = count_pairs(judged)
    assert pairs is not None
    assert (pairs.names.hits, pairs.overlap.hits, pairs.truth.hits) == (2, 1, 3)
    assert (pairs.truth.tries, pairs.better.hits) == (4, 2)
    rows = {target.what: target.met for target in check_targets(judged)}
    assert rows["two recordings of a rig: names agree"]
    assert rows["two recordings: intervals overlap"] is False
    assert count_pairs([replace(judged[0], pair=None)]) is None


def test_where_a_rest_is_always_on_it_may_be_said_and_not_be_named() -> None:
    rest = (UnlistedEffect("gain_along_rail", "drive", ("command", "cart_position")),)
    nothing, one = replace(make_seal(), rest=rest), replace(TRUTH, rest=rest)
    unexplained = make_answer(outcome="not_in_catalogue")
    assert judge_names(nothing, unexplained).outcome is NamesOutcome.RIGHT
    assert judge_names(make_seal(), unexplained).outcome is NamesOutcome.FALSE_ALARM
    alarm = make_answer(COULOMB, outcome="not_in_catalogue")
    assert judge_names(nothing, alarm).outcome is NamesOutcome.FALSE_ALARM
    assert judge_names(one, alarm).outcome is NamesOutcome.RIGHT
    assert judge_names(one, unexplained).outcome is NamesOutcome.MISSED


def make_pair(answer) -> PairJudgement:
    return PairJudgement(answer, True, (), (), 30.0, 12.0)


REST = (UnlistedEffect("gain_along_rail", "drive", ("command", "cart_position")),)
TWO = make_seal(COULOMB, DELAY)


@pytest.mark.parametrize(
    ("seal", "answer", "counts"),
    [
        (TWO, make_answer(COULOMB, DELAY), NameCounts(2, 0, 2, 0)),
        (TWO, make_answer(COULOMB), NameCounts(1, 0, 2, 1)),
        (TWO, make_answer(COULOMB, LAG), NameCounts(2, 1, 2, 1)),
        (TWO, make_answer(COULOMB, LAG, ties={LAG: (DELAY,)}), NameCounts(2, 0, 2, 0)),
        (TWO, make_answer(error="crash"), NameCounts(0, 0, 2, 2)),
        (make_seal(), make_answer(LAG), NameCounts(1, 1, 0, 0)),
        (make_seal(unlisted=REST), make_answer(outcome="not_in_catalogue"), NameCounts()),
        (
            make_seal(unlisted=REST),
            make_answer("cart_sign_inverted", LAG, outcome="not_in_catalogue"),
            NameCounts(2, 1, 0, 0),
        ),
    ],
    ids=["right", "silent", "wrong", "tied", "crash", "alarm", "unlisted", "sign beside unlisted"],
)
def test_wrong_names_are_counted_apart_from_silent_effects(seal, answer, counts) -> None:
    assert count_names(seal, answer) == counts


def test_names_of_both_recordings_count() -> None:
    trial = make_trial(COULOMB, DELAY)
    judged = [
        make_judgement(trial, make_answer(COULOMB, DELAY), pair=make_pair(make_answer(COULOMB))),
        make_judgement(trial, make_answer(COULOMB, DELAY), pair=make_pair(make_answer(LAG))),
        make_judgement(make_trial(), make_answer()),
    ]
    rows = {target.what: target for target in check_targets(judged)}
    wrong = rows["wrong names, of all names told"]
    assert wrong.share == Share(1, 6) and wrong.target == "at most 2 %" and wrong.met is False
    silent = rows["silent: concealed effects without a name"]
    assert silent.share == Share(3, 8) and silent.met is None and silent.target == NO_TARGET
    alone = {target.what: target for target in check_targets([replace(judged[1], pair=None)])}
    assert alone["wrong names, of all names told"].share == Share(0, 2)
    assert alone["wrong names, of all names told"].met


def test_rows_whose_targets_are_not_meant_for_rigs_with_a_rest_say_so() -> None:
    trial = replace(make_trial(COULOMB), seal=replace(TRUTH, rest=REST))
    judged = [make_judgement(trial, make_answer(), pair=make_pair(make_answer(COULOMB)))]
    rows = {target.what: target for target in check_targets(judged)}
    aside = [what for what, target in rows.items() if target.target == WITHOUT_REST]
    assert aside == [
        "one effect: named right",
        "two effects: named right",
        "three effects: named right",
        "four effects: named right",
        "sizes: relative error",
        "95 % intervals that hold the truth",
        "held-out score / the oracle fit's",
    ]
    assert all(rows[what].met is None for what in aside)
    assert rows["one effect: named right"].share == Share(0, 1)  # the figure stays
    assert rows["two recordings of a rig: names agree"].target == "at least 90 %"
    assert rows["wrong names, of all names told"].met
    plain = make_judgement(make_trial(COULOMB), make_answer())
    assert not [t for t in check_targets([plain]) if t.target == WITHOUT_REST]
