"""The fixed words of the report: complete, and none that nothing uses."""

import ast
from dataclasses import fields
from pathlib import Path
from typing import get_args

from support.made_recordings import INTECO

from pendulum_sysid.finding import localisation
from pendulum_sysid.finding.late_command import LATE
from pendulum_sysid.fitting.parameters import list_rig_parameters
from pendulum_sysid.records import FaultKind, Outcome
from pendulum_sysid.telling import wording
from pendulum_sysid.verdict.scores import FitScores
from pendulum_twin.effects.effect import Place


def list_strings(folder: Path) -> set[str]:
    """Return the string constants in a folder's modules, products split into their factors."""
    strings = set()
    for path in folder.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                strings |= set(node.value.split("*"))
    return strings


def test_every_variable_is_one_that_the_localisation_asks_about() -> None:
    assert set(wording.VARIABLES) <= list_strings(Path(localisation.__file__).parent)


def test_every_kind_of_fault_that_is_reported_has_words() -> None:
    cleaning = Path(localisation.__file__).parents[2] / "cleaning"
    assert set(wording.QUALITY) == set(get_args(FaultKind.__value__))
    assert set(wording.QUALITY) - {LATE} <= list_strings(cleaning)  # late: finding/late_command


def test_the_other_words_are_those_of_closed_sets() -> None:
    assert set(wording.OUTCOMES) == set(Outcome)
    assert set(wording.PLACES) == {place.value for place in Place}
    assert set(wording.FORCE_PLACES) <= set(wording.PLACES)
    assert set(wording.RIG_PARAMETERS) == {p.name for p in list_rig_parameters(INTECO)}
    scores = {f.name for f in fields(FitScores)} - {"noise_floor", "unit"}
    assert set(wording.FIT_ROWS) == scores


def test_a_product_has_the_words_of_its_factors_and_no_unit() -> None:
    assert wording.name_variable("command") == ("command", "")  # volts, on some rigs
    assert wording.name_variable("pole_rate") == ("pole rate", "rad/s")
    assert wording.name_variable("cart_velocity*time") == ("cart velocity × time", "")
