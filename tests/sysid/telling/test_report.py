"""The report: complete, escaped, self-contained, and the same bytes every time."""

import math
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from support.drawn_verdicts import (
    COMMAND,
    CONTENT,
    RIG,
    make_ended,
    make_evidence,
    make_hour,
    make_named,
    make_overlay,
    make_unusable,
)

from pendulum_sysid.records import (
    Evidence,
    Localisation,
    Outcome,
    Overlay,
    QualityFinding,
    Trial,
)
from pendulum_sysid.telling import display
from pendulum_sysid.telling.report import list_trial_rows, render_page, write_report
from pendulum_sysid.telling.window_figures import compute_frame, spread_windows
from pendulum_sysid.telling.wording import OUTCOMES
from pendulum_sysid.verdict.record import Verdict
from pendulum_sysid.verdict.scores import Repeats
from pendulum_twin.model import Twin


class Reader(HTMLParser):
    """Collect a page's text and tags; fail on tags that are not closed in order."""

    VOID = frozenset({"meta", "br", "input"})

    def __init__(self, html: str) -> None:
        super().__init__()
        self.words: list[str] = []
        self.tags: list[tuple[str, dict]] = []
        self.open: list[str] = []
        self.feed(html)
        assert self.open == []
        self.text = " ".join(" ".join(self.words).split())

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] not in ("style", "script"):
            self.words.append(data)

    def attributes(self, name: str) -> list[str]:
        return [attributes[name] for _, attributes in self.tags if name in attributes]


@pytest.fixture(scope="module")
def html() -> str:
    return render_page(make_named())


def test_the_share_of_a_variable_is_not_taken_for_a_place(html: str) -> None:
    text = Reader(html).text
    assert "What the given twin lacks, by the variable that it goes with" in text
    assert "That is a relation, not a place" in text
    assert "The named effects act at cart and pole; this is the place of the clearest" in text
    verdict = make_named()
    single = replace(verdict, missing_physics=verdict.missing_physics[:1])
    unnamed = replace(verdict, outcome=Outcome.NOT_IN_CATALOGUE)
    for other in (single, unnamed):
        assert "The named effects act at" not in Reader(render_page(other)).text


def test_the_remainder_says_how_much_comes_again_or_how_to_see_it(html: str) -> None:
    assert "sysid next --repeat plans a recording that plays its plan twice" in Reader(html).text
    verdict = make_named()
    assert verdict.remainder is not None
    repeats = Repeats(0.755, 0.59, 0.885, 24, 66.4)
    measured = replace(verdict, remainder=replace(verdict.remainder, repeats=repeats))
    text = Reader(render_page(measured)).text
    assert "at least 75.5 % [59.0, 88.5] comes again where the same motion comes again" in text
    assert "24 windows of 1 s" in text and "at most 66.4 times the noise floor" in text
    assert "--repeat" not in text


def test_the_page_says_what_the_verdict_says(html: str) -> None:
    text = Reader(html).text
    for words in (
        "Diagnosis: inteco_60s",
        "✓ Missing physics named",
        CONTENT["sentence"],
        "6000 samples at 100 Hz",
        "12.0 s",
        "0.461 N [0.451, 0.472]",
        "over 99.9 %",
        "1.31 × 10⁻⁵ N·m·s² [1.12, 1.50] × 10⁻⁵",
        "pole_coulomb_friction",
        "6 of 14 held-out windows",
        "45.2 mm",
        "48.8 → 1.12",
        "43.7 times smaller",
        "83 %",
        "cart ◂ here",
        "12.1–14.0, 31.0–33.5 s",
        "−31 %",
        CONTENT["masking"][0],
        "1.62 times the noise floor",
        "What is left is at drive (time: the gain sinks",
        "0.00, 7.41, 29.00 s",
        "single samples far off",
        "Slow swings part",
        COMMAND,
    ):
        assert words in text.replace("\u00a0", " ").replace("\u202f", " "), words


@pytest.mark.parametrize("outcome", Outcome)
def test_every_outcome_has_its_page(outcome: Outcome) -> None:
    text = Reader(render_page(make_ended(outcome))).text
    words = OUTCOMES[outcome]
    assert (
        words.title in text
        and words.meaning in text
        and f"A sentence for {outcome.value}." in text
    )
    listed = outcome in (Outcome.NAMED, Outcome.AMBIGUOUS)
    assert (words.when_listed if listed else words.when_empty) in text
    assert bool(words.when_listed) == (outcome not in (Outcome.NOTHING_MISSING, Outcome.UNUSABLE))
    assert bool(words.when_empty) == (not listed)


def test_a_verdict_with_nothing_in_it_still_makes_a_page() -> None:
    text = Reader(render_page(make_unusable())).text
    assert "Nothing to draw" in text and "No faults found in the data" in text
    assert "None" not in re.sub(r"None[.\s]|None[ a-z]", "", text)
    assert "nan" not in text.lower().split()


def test_the_data_quality_says_what_a_kind_alone_does_not() -> None:
    note = "the cart does not answer its command yet"
    fault = QualityFinding("stale", 1, ((0.0, 0.5),), note)
    assert note in Reader(render_page(replace(make_named(), data_quality=(fault,)))).text


def test_only_a_command_that_was_run_is_shown() -> None:
    assert "How to reproduce" in render_page(make_named())
    assert "How to reproduce" not in render_page(replace(make_named(), command=""))


@pytest.mark.parametrize("shape", [(0, 0), (0, 101), (1, 1), (1, 2), (3, 101)])
@pytest.mark.parametrize("value", [0.0, 3.14159, math.nan, 1e300, -math.inf])
def test_any_run_can_be_drawn(shape: tuple[int, int], value: float) -> None:
    times = np.cumsum(np.ones(shape), axis=0)
    still = Overlay(
        "pole",
        "rad",
        times,
        np.full(shape, math.pi),
        np.full(shape, value),
        np.full(shape, math.pi),
    )
    text = Reader(render_page(replace(make_unusable(), overlays=(still,)))).text
    assert ("Nothing to draw" in text) == (0 in shape)


def test_a_run_out_of_the_picture_is_cut_and_said() -> None:
    far = make_overlay("cart", "m", 0.3, 1000.0)
    low, high = compute_frame(far.measured[0], far.after[0])
    assert -0.6 < low < high < 0.6
    assert "before: up to" in render_page(replace(make_unusable(), overlays=(far,)))


def test_a_product_and_what_was_measured_of_it_stand_at_the_picture() -> None:
    band = np.array([9.0, 0.1, 0.1, 0.1, 9.0])
    product = Evidence(
        "cart_velocity*time", "dry friction grows", 0.9, np.arange(5.0), np.arange(5.0), band,
        "time", "dry friction", "N", "cart",
    )  # fmt: skip
    text = render_page(replace(make_named(), localisation=Localisation("cart", (product,))))
    assert "cart velocity × time" in text and "dry friction (N) against time (s)" in text


def test_the_table_of_windows_has_units_and_no_minus_zero(html: str) -> None:
    tags = Reader(html).tags
    labels = [attributes.get("data-label", "") for tag, attributes in tags if tag == "td"]
    cells = re.findall(r'data-label="(?:cart|pole) (?:before|after)">([^<]*)<', html)
    assert labels.count("cart before") == len(cells) // 4 > 3
    assert all(re.search("\u00a0(m|rad)$", cell) for cell in cells), cells[:4]
    assert display.format_seconds(-1e-9) == "0.00" and display.format_seconds(-0.5) == "−0.50"


def test_windows_are_spread_over_the_record() -> None:
    times = np.arange(40.0)[::-1, None] + np.linspace(0, 1, 5)
    assert spread_windows(times).tolist() == [39, 31, 23, 16, 8, 0]
    assert spread_windows(times[:2]).tolist() == [1, 0]


def test_what_comes_from_data_is_escaped() -> None:
    evil = "<script>alert('x')</script>"

    place = Localisation("cart", (replace(make_evidence()[0], variable=evil, finding=evil),))
    verdict = replace(
        poison(make_named(), evil),
        twin=Twin(evil, RIG),
        localisation=place,
        trials=(Trial((evil,), 1, 1, evil),),
        overlays=(make_overlay(evil, evil, 1, 1),),
        command=evil,
    )
    html = render_page(verdict)
    assert evil not in html and "&lt;script&gt;" in html
    assert html.count("<script") == 3 == [tag for tag, _ in Reader(html).tags].count("script")


def poison(verdict: Verdict, evil: str) -> Verdict:
    """Return the verdict with every text that is free replaced; names of closed sets stay."""
    closed = {"schema", "outcome", "place", "kind"}

    def poison_value(value: object, key: str = "") -> object:
        if isinstance(value, dict):
            return {k: poison_value(v, k) for k, v in value.items()}
        if isinstance(value, list):
            return [poison_value(v, key) for v in value]
        return evil if isinstance(value, str) and key not in closed else value

    return Verdict.from_dict(poison_value(verdict.to_dict()))


def test_the_page_needs_nothing_from_outside(html: str) -> None:
    read = Reader(html)
    links = [link for name in ("src", "href", "xlink:href") for link in read.attributes(name)]
    beside = {link for link in links if not link.startswith("#")}
    assert beside == {"verdict.json", "twin.yaml", "next.yaml"}
    assert {tag for tag, _ in read.tags}.isdisjoint({"link", "img", "iframe", "object"})
    assert set(re.findall(r"https?://[^\"' >]+", html)) <= {
        "http://www.w3.org/2000/svg",
        "http://www.w3.org/1999/xlink",
        "https://github.com/leeoniya/uPlot",  # where the script of the plots comes from
    }
    assert "@import" not in html and set(re.findall(r"url\((.)", html)) <= {"#"}


def test_ids_are_unique_and_references_are_kept(html: str) -> None:
    ids = Reader(html).attributes("id")
    assert len(ids) == len(set(ids))
    assert set(re.findall(r'(?:url\(|href=")#([^")]+)', html)) <= set(ids)


def test_every_picture_has_words(html: str) -> None:
    pictures = [
        attributes
        for tag, attributes in Reader(html).tags
        if tag == "svg" and attributes.get("aria-hidden") != "true"
    ]
    windows, errors, shapes, whole, residuals, meanings, whiskers = 2 * 6, 2, 1, 1, 1, 2, 5 + 2
    assert len(pictures) == windows + errors + shapes + whole + residuals + meanings + whiskers
    assert all(picture["role"] == "img" and picture["aria-label"] for picture in pictures)


def test_the_page_is_small_and_the_same_every_time(html: str, tmp_path: Path) -> None:
    assert len(html.encode()) < 1_000_000
    assert len(render_page(make_hour()).encode()) < 2_000_000
    write_report(make_named(), tmp_path / "new" / "report.html")
    assert (tmp_path / "new" / "report.html").read_bytes() == html.encode()
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["report.html"]


def test_hypotheses_stand_best_first_and_the_chosen_one_is_marked() -> None:
    rows = list_trial_rows(make_named())
    assert [row.trial.choose for row in rows] == sorted(row.trial.choose for row in rows)
    assert [row.turn for row in rows if row.chosen] == [6]
    assert (rows[0].bar, rows[-1].bar) == (pytest.approx(0.05, abs=0.02), 1.0)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0, "0.00"), (1.14159, "1.14"), (-0.0421, "−0.0421"),
        (45678.9, "45 679"), (2.7344e-4, "2.73 × 10⁻⁴"), (3e7, "3.00 × 10⁷"), (math.inf, "∞"),
        (math.nan, "–"), (None, "–"), ("<b>", "–"), (True, "–"),
    ],
)  # fmt: skip
def test_numbers_have_sensible_digits(value: object, text: str) -> None:
    assert display.render_number(value).replace("\u00a0", " ").replace("\u202f", " ") == text


@pytest.mark.parametrize(
    ("numbers", "texts"),
    [
        ((0.46, 0.45, 0.47), ("0.460", "[0.450, 0.470]")),
        ((1.96, 1.9, 2.02), ("1.96", "[1.90, 2.02]")),
        ((-12.4, -13.9, -10.9), ("−12.4", "[−13.9, −10.9]")),
        ((2.7e-4, 2.6e-4, 2.8e-4), ("2.70 × 10⁻⁴", "[2.60, 2.80] × 10⁻⁴")),
        ((0.5723, None, None), ("0.5723", "–")),
        ((9.81, -math.inf, math.inf), ("9.810", "–")),
        ((2.0, 1.5, math.inf), ("2.000", "[1.50, ∞]")),
        ((1.0, 1.0, 1.0), ("1.000", "[1.000, 1.000]")),
        ((0.0, 0.0, 0.0), ("0.000", "[0.000, 0.000]")),
    ],
)
def test_an_estimate_shows_the_digits_that_its_interval_is_worth(
    numbers: tuple, texts: tuple[str, str]
) -> None:
    assert (
        tuple(text.replace("\u00a0", " ") for text in display.format_estimate(*numbers)) == texts
    )


def test_units_are_set_as_one_writes_them() -> None:
    assert [display.format_unit(name) for name in ("N s^2/m^2", "kg m^2", "1", None)] == [
        "N·s²/m²",
        "kg·m²",
        "",
        "",
    ]


@pytest.mark.parametrize(
    ("plain", "printed"),
    [
        ("clipped at +-0.247.", "clipped at ±0.247."),
        ("cart 53.9 -> 1.71 mm", "cart 53.9 → 1.71 mm"),
        ("known to +-4.5e-05 N m", "known to ±4.5 × 10⁻⁵ N m"),
        ("1.06 N at -0.5 to -1.05 N", "1.06 N at −0.5 to −1.05 N"),
        ("run-5e-2.csv of 2026-11-23, a slip-4", "run-5e-2.csv of 2026-11-23, a slip-4"),
    ],
)
def test_sentences_are_printed_with_the_signs_of_a_page(plain: str, printed: str) -> None:
    assert display.format_sentence(plain).replace("\u00a0", " ") == printed
