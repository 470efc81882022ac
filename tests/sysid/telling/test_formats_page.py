"""The page of the formats says of a verdict what the code writes, as docstrings and report do."""

import re
from dataclasses import fields

import pytest
from support.paths import ROOT

from pendulum_sysid.telling.wording import DEFINITIONS
from pendulum_sysid.verdict.json_form import LEFT_OUT_IF_NONE
from pendulum_sysid.verdict.scores import FitScores, Remainder, Repeats, WanderingForce

PAGE = " ".join((ROOT / "docs" / "formats.md").read_text().split())
FLOORS = (
    "of all held-out windows together where nothing explains the error, or the recording does "
    "not look like its rig, and that is more"
)


@pytest.mark.parametrize(
    "text",
    [PAGE, FitScores.__doc__, dict(DEFINITIONS)["Error in noise floors"]],
    ids=["page", "docstring", "report"],
)
def test_the_scale_of_the_report_has_one_definition(text: str) -> None:
    """Report and docstring told of whole windows with fitted starts, which the code had left."""
    assert FLOORS in " ".join(text.split())


def test_the_page_names_the_keys_that_are_left_out() -> None:
    clause = re.search(r"Fields that have no value are `null`, but (.*?) are left out", PAGE)
    assert clause is not None
    names = {name.split(".")[-1] for name in re.findall(r"`([\w.]+)`", clause[1])}
    assert names == LEFT_OUT_IF_NONE


@pytest.mark.parametrize(
    ("key", "kind"),
    [
        ("fit", FitScores),
        ("remainder", Remainder),
        ("remainder.repeats", Repeats),
        ("remainder.wandering", WanderingForce),
    ],
)
def test_every_key_has_a_row(key: str, kind: type) -> None:
    for field in fields(kind):
        assert re.search(rf"\| [^|]*`{key}\.{field.name}`[^|]* \|", PAGE), field.name
