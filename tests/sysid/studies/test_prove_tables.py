"""What judged trials come to: shares, sizes, targets, matrix, doses, and the page."""

import math
from collections.abc import Sequence
from dataclasses import replace
from html.parser import HTMLParser

import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.prove_trials import (
    DRAG,
    make_answer,
    make_judgement,
    make_seal,
    make_size,
    make_trial,
)

from pendulum_sysid.studies.proof import statistics
from pendulum_sysid.studies.proof.dose_response import (
    Dose,
    Response,
    find_least,
    list_dosed_sets,
    measure_dose,
    measure_responses,
)
from pendulum_sysid.studies.proof.page import render_page
from pendulum_sysid.studies.proof.pictures import draw_scatter, draw_strip
from pendulum_sysid.studies.proof.plan import Plan
from pendulum_sysid.studies.proof.proof_json import make_proof_mapping
from pendulum_sysid.studies.proof.proof_text import format_proof
from pendulum_sysid.studies.proof.records import (
    HeldOut,
    Judgement,
    ModelJudgement,
    RivalJudgement,
    Seal,
)
from pendulum_sysid.studies.proof.rival_models.table import TWIN, compare_predictors
from pendulum_sysid.studies.proof.share import Share, count_share
from pendulum_sysid.studies.proof.sizes import (
    compare_effect_sizes,
    compare_rig_constants,
    compute_mass_scale,
    describe_deviation,
)
from pendulum_sysid.studies.proof.targets import check_targets
from pendulum_twin.rig import Rig

COULOMB, QUADRATIC = "cart_coulomb_friction", "cart_quadratic_drag"
VOID_TAGS = {"area", "base", "br", "col", "hr", "img", "input", "link", "meta"}


@given(st.integers(0, 200), st.integers(1, 200))
def test_a_share_lies_in_its_interval(hits: int, misses: int) -> None:
    share = Share(hits, hits + misses)
    assert 0.0 <= share.low <= share.value + 1e-12 and share.value <= share.high <= 1.0
    assert share.high - share.low > 0.0


def test_the_interval_is_wilsons() -> None:
    """By hand: no hit in 30 gives z^2/(30 + z^2) at the top."""
    none, half = Share(0, 30), Share(10, 20)
    assert (none.low, none.high) == (pytest.approx(0.0), pytest.approx(0.11351, abs=1e-4))
    assert half.low == pytest.approx(0.2993, abs=1e-4)
    assert half.high == pytest.approx(0.7007, abs=1e-4)
    assert count_share([]).value is None and count_share([]).low is None


# Sizes


def make_estimate(value: float, half: float) -> dict[str, float]:
    return {"value": value, "low": value - half, "high": value + half}


def make_sized_seal(effects: dict[str, dict[str, float]]) -> Seal:
    return replace(make_seal(), effects=effects)


def test_sizes_stand_beside_the_truth() -> None:
    seal = make_sized_seal({COULOMB: {"level_n": 0.5}, "rail_tilt": {"angle_rad": 0.01}})
    named = [
        {"effect": COULOMB, "parameters": {"level_n": make_estimate(0.51, 0.02)}},
        {"effect": QUADRATIC, "parameters": {"n_s2_m2": make_estimate(1.0, 0.1)}},
    ]
    (size,) = compare_effect_sizes(seal, named)
    assert (size.owner, size.parameter, size.true, size.inside) == (COULOMB, "level_n", 0.5, True)
    assert size.relative_error == pytest.approx(0.02) and size.half_width == pytest.approx(0.02)
    assert describe_deviation(size) == "right"
    (size,) = compare_effect_sizes(seal, named, scale=2.0)
    assert size.true == 1.0 and not size.inside
    assert describe_deviation(size) == "off by -49 %"


def test_a_truth_outside_its_interval_is_described_by_its_distance() -> None:
    """A negative truth keeps its sign, and a truth of 0 has no relative distance."""
    assert describe_deviation(make_size(true=-1.0, value=-2.0)) == "off by -1e+02 %"
    assert describe_deviation(make_size(true=0.0, value=0.3)) == "off by +0.3 N"


def test_a_phase_is_known_up_to_whole_turns() -> None:
    truth = {"amplitude_n": 0.3, "period_m": 0.1, "phase_rad": 0.1}
    estimates = {
        "amplitude_n": make_estimate(0.3, 0.1),
        "period_m": make_estimate(0.1, 0.1),
        "phase_rad": make_estimate(0.1 - 2 * math.pi, 0.1),
    }
    phase = compare_effect_sizes(
        make_sized_seal({"cogging": truth}), [{"effect": "cogging", "parameters": estimates}]
    )[2]
    assert phase.shape and phase.inside and phase.true == pytest.approx(0.1 - 2 * math.pi)


def test_only_identifiable_constants_count() -> None:
    seal = make_seal()
    force = {"after": 12.0, "low": 11.0, "high": 13.0, "unit": "N", "identifiable": True}
    (size,) = compare_rig_constants(seal, {"force_per_pwm_n": force})
    assert (size.parameter, size.value) == ("force_per_pwm_n", 12.0)
    unknown = {**force, "identifiable": False}
    assert compare_rig_constants(seal, {"force_per_pwm_n": unknown}) == ()


def test_an_interval_that_is_null_in_json_has_no_end() -> None:
    force = {"after": 12.0, "low": None, "high": None, "unit": "N", "identifiable": True}
    (size,) = compare_rig_constants(make_seal(), {"force_per_pwm_n": force})
    assert (size.low, size.high, size.inside) == (-math.inf, math.inf, True)


def test_forces_are_compared_per_nominal_mass() -> None:
    seal = make_seal()
    masses = {key: 2 * seal.rig[key] for key in ("cart_mass_kg", "pole_mass_kg")}
    heavy = Rig(**{**seal.rig, **masses})
    assert compute_mass_scale(seal, heavy) == pytest.approx(2.0)


# Tables


def make_judgements() -> list[Judgement]:
    plain = make_judgement(make_trial(), make_answer(COULOMB)).names
    rivals = {"plain": RivalJudgement((COULOMB,), plain, 3.0)}
    unlisted = make_answer(outcome="not_in_catalogue", place="cart", variables=("cart_velocity",))
    return [
        make_judgement(
            make_trial(COULOMB, name="trial_0000"),
            make_answer(COULOMB),
            sizes=(make_size(),),
            rig=(make_size(2.0, 3.0),),
            rivals=rivals,
        ),
        make_judgement(
            make_trial(COULOMB, name="trial_0001"), make_answer(QUADRATIC), rivals=rivals
        ),
        make_judgement(
            make_trial(name="trial_0002"),
            make_answer(),
            held_out=HeldOut(9.0, 2.6, 2.0, 1.0),
            rivals=rivals,
        ),
        make_judgement(
            make_trial(unlisted=(DRAG,), name="trial_0003"),
            unlisted,
            held_out=HeldOut(9.0, 9.0, 1.0, 1.0),
            rig=(make_size(2.0, 3.0),),
            rivals=rivals,
        ),
    ]


def test_targets_say_what_is_met_and_what_was_not_tried() -> None:
    targets = {target.what: target for target in check_targets(make_judgements())}
    assert targets["one effect: named right"].met is False
    assert targets["one effect: named right"].share == Share(1, 2)
    assert targets["two effects: named right"].met is None
    assert targets["nothing hidden: false alarms"].met is True
    assert targets["not in the catalogue: not misnamed, place right"].met is True
    intervals = targets["95 % intervals that hold the truth"]
    assert intervals.share == Share(1, 2)  # no interval of the unlisted trial
    assert targets["held-out score / the oracle fit's"].met is False
    assert targets["CPU seconds for 60 s of recording"].met is True
    assert all(target.met is None for target in check_targets([]))


@pytest.mark.parametrize(
    ("inside", "outside", "met"), [(7, 0, True), (400, 0, False), (95, 5, True), (80, 20, False)]
)
def test_intervals_may_be_neither_too_narrow_nor_too_wide(
    inside: int, outside: int, met: bool
) -> None:
    sizes = (make_size(),) * inside + (make_size(value=9.0),) * outside
    judgement = make_judgement(make_trial(COULOMB), make_answer(COULOMB), sizes=sizes)
    (target,) = [t for t in check_targets([judgement]) if "intervals" in t.what]
    assert target.met is met


def test_held_out_scores_are_compared_where_an_oracle_fit_can_be() -> None:
    assert sorted(statistics.list_ratios(make_judgements())) == [1.0, 1.0, pytest.approx(1.3)]


def test_methods_stand_side_by_side() -> None:
    judgements = make_judgements()
    diagnosis, rival = statistics.compare_methods(judgements)
    assert (diagnosis.name, diagnosis.right["single"]) == ("diagnosis", Share(1, 2))
    assert diagnosis.wrong == Share(1, 4)
    assert (rival.name, rival.false_alarms, rival.seconds.median) == ("plain", Share(1, 1), 3.0)
    unseen_by_rival = make_judgement(make_trial(), make_answer())
    assert len(statistics.compare_methods([*judgements, unseen_by_rival])) == 1


def test_seconds_are_for_a_recording_of_a_minute() -> None:
    judgement = make_judgement(make_trial(seconds=30.0), make_answer())
    assert statistics.scale_seconds([judgement]).median == 20.0


def test_the_matrix_counts_every_name() -> None:
    matrix = statistics.count_confusion(make_judgements())
    assert matrix.counts[COULOMB, COULOMB] == 1 and matrix.counts[COULOMB, QUADRATIC] == 1
    assert matrix.rows[0] == COULOMB and matrix.rows[-1] == "(nothing)"
    assert matrix.columns[-2:] == ("not_in_catalogue", "not named")


def test_json_holds_every_trial() -> None:
    proof = make_proof_mapping(Plan(4, 1), make_judgements(), [], 1.0)
    outcomes = [trial["judged"]["how"] for trial in proof["trials"]]
    assert outcomes == ["right", "wrong", "right", "right"]
    assert proof["marks"][0]["share"]["hits"] == 1
    assert proof["trials"][0]["held_out"]["told"] == 2.0


# Dose-response


def make_dose(factor: float, hits: int) -> Dose:
    return Dose(COULOMB, factor, Share(hits, 2), "level_n", "N", factor, 10.0)


def test_the_smallest_size_found_has_no_larger_size_that_is_not() -> None:
    assert find_least([make_dose(1.0, 2), make_dose(0.5, 1), make_dose(0.25, 0)]).factor == 0.5
    assert find_least([make_dose(1.0, 2), make_dose(0.5, 0), make_dose(0.25, 2)]).factor == 1.0
    assert find_least([make_dose(1.0, 0)]) is None


def test_a_dose_is_measured_in_half_widths() -> None:
    oracle = (make_size(true=0.5, value=0.52, half=0.1),)
    judgement = make_judgement(make_trial(COULOMB), make_answer(COULOMB), oracle=oracle)
    dose = measure_dose(COULOMB, 0.5, [judgement])
    assert (dose.parameter, dose.size, dose.named) == ("level_n", 0.5, Share(1, 1))
    assert dose.half_widths == pytest.approx(5.0)


def test_a_lost_effect_is_not_made_smaller_but_tried_once_in_between() -> None:
    calls = []

    def run_sets(sets: Sequence[str], factor: float) -> list[Judgement]:
        calls.append((factor, list(sets)))
        seen = {COULOMB: factor > 0.3, QUADRATIC: False}
        return [
            make_judgement(make_trial(name), make_answer(*([name] if seen[name] else [])))
            for name in sets
        ]

    friction, drag = measure_responses(run_sets, [COULOMB, QUADRATIC])
    assert calls == [(1.0, [COULOMB, QUADRATIC]), (0.25, [COULOMB]), (0.5, [COULOMB])]
    assert friction.least.factor == 0.5 and drag.least is None
    assert [dose.factor for dose in friction.doses] == [1.0, 0.5, 0.25]


def test_every_effect_with_a_size_is_dosed() -> None:
    sets = list_dosed_sets()
    assert COULOMB in sets and "cart_coulomb_friction+cart_friction_asymmetry" in sets
    assert {"cart_sign_inverted", "stale_start", "thesis_dead_zones"}.isdisjoint(sets)


# The page


class TagBalance(HTMLParser):
    """Fails when a tag is closed that is not open."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []

    def handle_starttag(self, tag: str, attrs: object) -> None:
        if tag not in VOID_TAGS:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: object) -> None:
        pass

    def handle_endtag(self, tag: str) -> None:
        assert self.open and self.open.pop() == tag, tag


def render(judgements: Sequence[Judgement], responses: Sequence[Response] = ()) -> str:
    """Return the page, checked to be whole and self-contained."""
    html = render_page(Plan(len(judgements), 1, rivals=("plain",)), judgements, responses, 12.0)
    reader = TagBalance()
    reader.feed(html)
    assert reader.open == []
    assert "src=" not in html and 'href="http' not in html and "url(http" not in html
    return html


def measure_nothing(sets: Sequence[str], factor: float) -> list[Judgement]:
    return []


def test_the_page_is_whole() -> None:
    html = render(make_judgements(), measure_responses(measure_nothing, [COULOMB]))
    for text in (
        "Not all targets are met",
        "wrong name",
        "trial_0001",
        "plain",
        "1 of 2 (50 %)",
        "oracle fit",
        "<svg",
    ):
        assert text in html
    assert "&lt;" not in html


def test_a_dose_stands_on_the_page() -> None:
    found = make_dose(1.0, 2)
    html = render(make_judgements(), [Response(COULOMB, (found, make_dose(0.25, 0)), found)])
    assert "2 of 2" in html and "0 of 2" in html and "1/4" in html


def test_the_page_of_no_trials_says_so() -> None:
    assert "none could be judged" in render([])


def test_text_from_data_is_escaped() -> None:
    html = render([make_judgement(make_trial(), make_answer(error="<script>"))])
    assert "<script>" not in html and "&lt;script&gt;" in html


def test_pictures_draw_a_mark_for_every_value() -> None:
    strip = draw_strip([0.01, -0.02, 0.5, math.inf], 0.05, "level", "errors of level")
    assert strip.startswith("<svg") and strip.count("<use") == 4 and 'aria-label="errors' in strip
    points = [(1.0, 2.0), (2.0, 2.0), (0.0, 1.0), (1.0, math.nan)]
    scatter = draw_scatter(points, "oracle fit", "improved twin", 1.2, "scores")
    assert ">oracle fit<" in scatter and 'aria-label="improved twin against oracle' in scatter
    assert draw_strip([], 0.05, "none", "none") == draw_scatter([], "x", "y", 1.2, "none") == ""


def test_the_text_has_targets_rivals_and_doses() -> None:
    text = format_proof(make_judgements(), measure_responses(measure_nothing, [COULOMB]))
    assert "one effect: named right" in text and "plain" in text and "not found" in text
    assert all(line == line.rstrip() for line in text.splitlines())


# Rivals that predict


def make_predicted() -> list[Judgement]:
    """Two rigs with unlisted physics, predicted by a rival that then breaks off."""
    models = (ModelJudgement(2.0, 7.0), ModelJudgement(None, 1.0, "ValueError: no <root>"))
    return [
        make_judgement(
            make_trial(unlisted=(DRAG,), name=f"trial_000{k}"),
            make_answer(outcome="not_in_catalogue", place="cart"),
            modelled=1.25,
            models={"plain_model": model},
        )
        for k, model in enumerate(models)
    ]


def test_predictors_stand_side_by_side() -> None:
    twin, rival = compare_predictors(make_predicted())
    assert (twin.name, twin.within) == (TWIN, (Share(2, 2), Share(2, 2)))
    assert (rival.name, rival.within) == ("plain_model", (Share(0, 2), Share(1, 2)))
    assert rival.quantiles.median == 2.0 and rival.cpu_seconds.worst == 7.0
    assert [predictor.name for predictor in compare_predictors(make_judgements())] == [TWIN]


def test_the_tables_have_a_column_for_each_rival_that_predicts() -> None:
    judgements = make_predicted()
    lines = format_proof(judgements, []).splitlines()
    (heading,) = [line for line in lines if line.startswith("unlisted physics")]
    assert heading.endswith("floors elsewhere  plain_model")
    rows = [line.split()[-2:] for line in lines if line.startswith(DRAG.name)]
    assert rows == [["1.25", "2"], ["1.25", "error"]]
    assert "trial_0001, plain_model: ValueError: no <root>" in lines
    html = render(judgements)
    assert ">plain<br>model<" in html and ">1.25<" in html and "no &lt;root&gt;" in html
    proof = make_proof_mapping(Plan(2, 1), judgements, [], 1.0)
    assert [predictor["name"] for predictor in proof["predictors"]] == [TWIN, "plain_model"]
    assert proof["trials"][0]["models"]["plain_model"]["floors"] == 2.0
    assert make_proof_mapping(Plan(4, 1), make_judgements(), [], 1.0)["predictors"] == []
