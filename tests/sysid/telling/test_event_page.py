"""A page about an event, or about a rig that changed, blames no place of the chain."""

from collections import namedtuple
from dataclasses import replace
from typing import Any

import numpy as np
from support.drawn_verdicts import make_ended

from pendulum_sysid.records import Outcome
from pendulum_sysid.telling.events import Events
from pendulum_sysid.telling.light import judge_light
from pendulum_sysid.telling.outcome import Findings
from pendulum_sysid.telling.report import render_page
from pendulum_sysid.telling.sentences import write_answer
from pendulum_sysid.telling.wording import EVENTS, OUTCOMES
from pendulum_sysid.verdict.record import MissingEffect, Verdict

TIMES = ((11.0, 12.0),)
BLAMES = ("The mismatch comes in at", "</span> here", "<dt>Place</dt>", "What is left is")


def make_event() -> Verdict:
    return replace(make_ended(Outcome.NOT_IN_CATALOGUE), events_s=TIMES)


def test_the_page_says_when_and_not_where() -> None:
    """The sentence told a touch, and the page that the mismatch comes in at the pole."""
    page = render_page(make_event())
    assert EVENTS.title in page and EVENTS.meaning in page
    assert OUTCOMES[Outcome.NOT_IN_CATALOGUE].meaning not in page
    assert "At no place of the chain: something acted on the rig at 11.0–12.0" in page
    for blame in BLAMES:
        assert blame not in page
        assert blame in render_page(replace(make_event(), events_s=()))


def test_a_rig_that_changed_has_no_place_for_all_recordings() -> None:
    page = render_page(replace(make_ended(Outcome.NOT_IN_CATALOGUE), rig_changed=True))
    assert "At no place that holds for all recordings: the rig changed between them" in page
    for blame in BLAMES:
        assert blame not in page


def test_the_light_says_when() -> None:
    reasons = " ".join(judge_light(make_event()).reasons)
    assert "something acted on the rig at 11.0–12.0" in reasons
    assert "something is missing" not in reasons


def test_an_effect_that_is_certain_is_told_beside_an_event() -> None:
    friction = MissingEffect("cart_coulomb_friction", (), 0.99, {}, "Dry friction holds the cart.")
    runs = namedtuple("Runs", "channels rmse seconds")((0,), np.ones(1), 1.0)
    blank: dict[str, Any] = dict.fromkeys(Findings.__dataclass_fields__)
    findings = Findings(**{**blank, "before": {"held_out": runs}, "after": {"held_out": runs}})
    about = (Outcome.NOT_IN_CATALOGUE, (), (friction,), findings, Events(TIMES, 1.0))
    answer = write_answer(*about)
    assert answer.startswith("Something that no effect of the catalogue explains acts on the rig")
    assert answer.endswith(" mm. Dry friction holds the cart. This part is certain.")
