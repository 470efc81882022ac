"""What many judged trials come to: shares, marks, matrix, doses, and the page."""

import math
from html.parser import HTMLParser

import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.prove_trials import DRAG, answer, judgement, sealed, size

from pendulum_sysid.studies.proof import statistics
from pendulum_sysid.studies.proof.dose_response import (
    Dose,
    find_least,
    list_dosed_sets,
    measure_dose,
    measure_responses,
)
from pendulum_sysid.studies.proof.page import render_page
from pendulum_sysid.studies.proof.plan import Plan
from pendulum_sysid.studies.proof.proof_json import make_proof_mapping
from pendulum_sysid.studies.proof.proof_text import format_proof
from pendulum_sysid.studies.proof.records import HeldOut, RivalJudged
from pendulum_sysid.studies.proof.share import Share, count_share
from pendulum_sysid.studies.proof.sizes import (
    compare_effect_sizes,
    compare_rig_constants,
    compute_mass_scale,
)
from pendulum_sysid.studies.proof.targets import check_targets
from pendulum_twin.rig import Rig

COULOMB, DRAG_NAMED = "cart_coulomb_friction", "cart_quadratic_drag"
VOID = {"area", "base", "br", "col", "hr", "img", "input", "link", "meta"}


@given(st.integers(0, 200), st.integers(1, 200))
def test_a_share_lies_in_its_interval(hits: int, more: int) -> None:
    one = Share(hits, hits + more)
    assert 0.0 <= one.low <= one.value + 1e-12 and one.value <= one.high <= 1.0
    assert one.high - one.low > 0.0


def test_the_interval_is_wilsons() -> None:
    """By hand: no hit in 30 gives z^2/(30 + z^2) at the top."""
    none = Share(0, 30)
    assert (none.low, none.high) == (pytest.approx(0.0), pytest.approx(0.11351, abs=1e-4))
    half = Share(10, 20)
    assert (half.low, half.high) == (
        pytest.approx(0.2993, abs=1e-4),
        pytest.approx(0.7007, abs=1e-4),
    )
    assert count_share([]).value is None and count_share([]).low is None


# Sizes


def found(value: float, half: float) -> dict:
    return {"value": value, "low": value - half, "high": value + half}


def test_sizes_stand_beside_the_truth() -> None:
    seal = sealed()
    seal = type(seal)(
        **{**vars(seal), "effects": {COULOMB: {"level_n": 0.5}, "rail_tilt": {"angle_rad": 0.01}}}
    )
    named = [
        {"effect": COULOMB, "parameters": {"level_n": found(0.51, 0.02)}},
        {"effect": DRAG_NAMED, "parameters": {"n_s2_m2": found(1.0, 0.1)}},
    ]
    (one,) = compare_effect_sizes(seal, named)
    assert (one.owner, one.parameter, one.true, one.inside) == (COULOMB, "level_n", 0.5, True)
    assert one.error == pytest.approx(0.02) and one.half_width == pytest.approx(0.02)
    (one,) = compare_effect_sizes(seal, named, scale=2.0)
    assert one.true == 1.0 and not one.inside


def test_a_phase_is_known_up_to_whole_turns() -> None:
    seal = sealed()
    truth = {"amplitude_n": 0.3, "period_m": 0.1, "phase_rad": 0.1}
    seal = type(seal)(**{**vars(seal), "effects": {"cogging": truth}})
    values = {
        "amplitude_n": found(0.3, 0.1),
        "period_m": found(0.1, 0.1),
        "phase_rad": found(0.1 - 2 * math.pi, 0.1),
    }
    phase = compare_effect_sizes(seal, [{"effect": "cogging", "parameters": values}])[2]
    assert phase.shape and phase.inside and phase.true == pytest.approx(0.1 - 2 * math.pi)


def test_only_identifiable_constants_count() -> None:
    seal = sealed()
    one = {"after": 12.0, "low": 11.0, "high": 13.0, "unit": "N", "identifiable": True}
    assert [s.parameter for s in compare_rig_constants(seal, {"force_per_pwm_n": one})] == [
        "force_per_pwm_n"
    ]
    assert compare_rig_constants(seal, {"force_per_pwm_n": {**one, "identifiable": False}}) == ()


def test_forces_are_told_in_units_of_the_nominal_mass() -> None:
    seal = sealed()
    heavy = Rig(
        **{
            **seal.rig,
            "cart_mass_kg": 2 * seal.rig["cart_mass_kg"],
            "pole_mass_kg": 2 * seal.rig["pole_mass_kg"],
        }
    )
    assert compute_mass_scale(seal, heavy) == pytest.approx(2.0)


# Tables


def trials() -> list:
    rival = {"plain": RivalJudged((COULOMB,), judgement(sealed(), answer(COULOMB)).names, 3.0)}
    return [
        judgement(
            sealed(COULOMB, name="trial_0000"),
            answer(COULOMB),
            sizes=(size(),),
            rig=(size(2.0, 3.0),),
            rivals=rival,
        ),
        judgement(sealed(COULOMB, name="trial_0001"), answer(DRAG_NAMED), rivals=rival),
        judgement(
            sealed(name="trial_0002"), answer(), held_out=HeldOut(9.0, 2.6, 2.0, 1.0), rivals=rival
        ),
        judgement(
            sealed(unlisted=(DRAG,), name="trial_0003"),
            answer(outcome="not_in_catalogue", place="cart", variables=("cart_velocity",)),
            held_out=HeldOut(9.0, 9.0, 1.0, 1.0),
            rig=(size(2.0, 3.0),),
            rivals=rival,
        ),
    ]


def test_marks_say_what_is_met_and_what_was_not_tried() -> None:
    by_name = {one.what: one for one in check_targets(trials())}
    assert by_name["one effect: named right"].met is False
    assert by_name["one effect: named right"].share == Share(1, 2)
    assert by_name["two effects: named right"].met is None
    assert by_name["nothing hidden: false alarms"].met is True
    assert by_name["not in the catalogue: not misnamed, place right"].met is True
    assert by_name["95 % intervals that hold the truth"].share == Share(
        1, 2
    )  # nothing of the unlisted one
    assert by_name["held-out score / that of a fit told the truth"].met is False
    assert by_name["seconds of work for 60 s of recording"].met is True
    assert all(one.met is None for one in check_targets([]))


@pytest.mark.parametrize(
    ("inside", "outside", "met"), [(7, 0, True), (400, 0, False), (95, 5, True), (80, 20, False)]
)
def test_intervals_may_be_neither_too_narrow_nor_too_wide(
    inside: int, outside: int, met: bool
) -> None:
    sizes = (*(size() for _ in range(inside)), *(size(value=9.0) for _ in range(outside)))
    (one,) = [
        m
        for m in check_targets([judgement(sealed(COULOMB), answer(COULOMB), sizes=sizes)])
        if "intervals" in m.what
    ]
    assert one.met is met


def test_held_out_scores_are_compared_where_the_truth_can_be_told() -> None:
    assert sorted(statistics.list_ratios(trials())) == [1.0, 1.0, pytest.approx(1.3)]


def test_methods_stand_side_by_side() -> None:
    diagnosis, rival = statistics.compare_methods(trials())
    assert (diagnosis.name, diagnosis.right["single"], diagnosis.wrong) == (
        "diagnosis",
        Share(1, 2),
        Share(1, 4),
    )
    assert (rival.name, rival.false_alarms, rival.seconds.median) == ("plain", Share(1, 1), 3.0)
    assert (
        len(statistics.compare_methods([*trials(), judgement(sealed(), answer())])) == 1
    )  # the rival did not see that one


def test_seconds_are_for_a_recording_of_a_minute() -> None:
    short = sealed()
    short = type(short)(**{**vars(short), "seconds": 30.0})
    assert statistics.scale_seconds([judgement(short, answer())]).median == 20.0


def test_the_matrix_counts_every_name() -> None:
    matrix = statistics.count_confusion(trials())
    assert matrix.counts[COULOMB, COULOMB] == 1 and matrix.counts[COULOMB, DRAG_NAMED] == 1
    assert matrix.rows[0] == COULOMB and matrix.rows[-1] == "(nothing)"
    assert matrix.columns[-2:] == ("not_in_catalogue", "not named")


def test_json_holds_every_trial() -> None:
    found = make_proof_mapping(Plan(4, 1), trials(), [], 1.0)
    assert [one["judged"]["how"] for one in found["trials"]] == [
        "right",
        "wrong",
        "right",
        "right",
    ]
    assert found["marks"][0]["share"]["hits"] == 1


# Dose-response


def dose_of(factor: float, hits: int) -> Dose:
    return Dose(COULOMB, factor, Share(hits, 2), "level_n", "N", factor, 10.0)


def test_the_smallest_size_found_has_none_larger_that_is_not() -> None:
    assert find_least([dose_of(1.0, 2), dose_of(0.5, 1), dose_of(0.25, 0)]).factor == 0.5
    assert find_least([dose_of(1.0, 2), dose_of(0.5, 0), dose_of(0.25, 2)]).factor == 1.0
    assert find_least([dose_of(1.0, 0)]) is None


def test_a_dose_is_told_in_half_widths() -> None:
    told = (size(true=0.5, value=0.52, half=0.1),)
    one = measure_dose(COULOMB, 0.5, [judgement(sealed(COULOMB), answer(COULOMB), told=told)])
    assert (one.parameter, one.size, one.found) == ("level_n", 0.5, Share(1, 1))
    assert one.half_widths == pytest.approx(5.0)


def test_what_is_not_found_is_not_made_smaller_but_asked_once_in_between() -> None:
    asked = []

    def ask(sets, factor):
        asked.append((factor, list(sets)))
        hits = {COULOMB: factor > 0.3, DRAG_NAMED: False}
        return [judgement(sealed(one), answer(*([one] if hits[one] else []))) for one in sets]

    found = measure_responses(ask, [COULOMB, DRAG_NAMED])
    assert asked == [(1.0, [COULOMB, DRAG_NAMED]), (0.25, [COULOMB]), (0.5, [COULOMB])]
    assert [one.least.factor if one.least else None for one in found] == [0.5, None]
    assert [dose.factor for dose in found[0].doses] == [1.0, 0.5, 0.25]


def test_what_has_a_size_is_dosed() -> None:
    sets = list_dosed_sets()
    assert COULOMB in sets and "cart_coulomb_friction+cart_friction_asymmetry" in sets
    assert not {"cart_sign_inverted", "stale_start", "thesis_dead_zones"} & set(sets)


# The page


class Balance(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []

    def handle_starttag(self, tag, attrs) -> None:
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs) -> None:
        pass

    def handle_endtag(self, tag) -> None:
        assert self.open and self.open.pop() == tag, tag


def shown(judged, doses=()) -> str:
    html = render_page(Plan(len(judged), 1, rivals=("plain",)), judged, list(doses), 12.0)
    reader = Balance()
    reader.feed(html)
    assert reader.open == [] and "src=" not in html and "http" not in html
    return html


def test_the_page_is_whole() -> None:
    html = shown(trials(), measure_responses(lambda sets, factor: [], [COULOMB]))
    for words in (
        "Not all marks are met",
        "wrong name",
        "trial_0001",
        "plain",
        "1 of 2 (50 %)",
        "told the truth",
    ):
        assert words in html
    assert "&lt;" not in html


def test_the_page_of_nothing_says_so() -> None:
    assert "none could be judged" in shown([])


def test_what_comes_from_data_is_escaped() -> None:
    one = judgement(sealed(), answer(error="<script>"))
    assert "<script>" not in shown([one]) and "&lt;script&gt;" in shown([one])


def test_what_is_printed_has_marks_rivals_and_doses() -> None:
    text = format_proof(trials(), measure_responses(lambda sets, factor: [], [COULOMB]))
    assert "one effect: named right" in text and "plain" in text and "not found" in text
    assert all(line == line.rstrip() for line in text.splitlines())
