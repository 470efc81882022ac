"""A measured law in words: every number with its unit."""

import re
from dataclasses import replace

import numpy as np
import pytest

from pendulum_sysid.measuring.curve import Curve
from pendulum_sysid.measuring.naming import NamedCurve
from pendulum_sysid.measuring.shape_fit import FittedShape
from pendulum_sysid.measuring.shapes import SETTLING_WAVE, SHAPES, TURN_SHAPES, Shape
from pendulum_sysid.telling.law_text import list_units, write_sentence
from pendulum_twin.laws import BY_NAME

ALL = (*SHAPES, *TURN_SHAPES[1:], SETTLING_WAVE)


def make_named(shape: Shape, law: str) -> NamedCurve:
    knots, count = np.linspace(0.1, 2.0, 5), len(shape.factors) + len(shape.more)
    values = np.arange(1.0, count + 1.0)
    fitted = FittedShape(shape, values, np.full(count, 0.1), np.ones(5), 1.0)
    curve = Curve(BY_NAME[law], knots, np.ones(5), 1.0, -10.0)
    return NamedCurve(curve, np.ones(5), np.zeros(5), 4.0, fitted)


@pytest.mark.parametrize("shape", ALL, ids=lambda shape: shape.name)
def test_every_number_of_a_sentence_has_its_interval_and_unit(shape: Shape) -> None:
    sentence = write_sentence(make_named(shape, "cart_drag_along_rail"))
    numbers = re.findall(r"[\d.]+ \[[^]]*\] (N s/m|m)\b", sentence)
    said = re.findall(r"{(\w\w+)}", shape.words)
    assert len(numbers) == len(said)
    assert numbers.count("m") == sum(name in shape.more for name in said)
    assert "{" not in sentence and "unit" not in sentence


def test_ratios_over_ratios_have_no_unit() -> None:
    line = next(shape for shape in SHAPES if shape.name == "line")
    assert write_sentence(make_named(line, "command_curve")) == (
        "The change of the command depends on the command: it is 1 [0.804, 1.2], and changes by 2 "
        "[1.8, 2.2] for each unit."
    )
    assert list_units(line, BY_NAME["command_curve"]) == {"offset": "1", "slope": "1"}


def test_a_drag_adds_to_the_twin_s_constant_and_says_so() -> None:
    for law in ("cart_drag_along_rail", "pole_drag_by_angle"):
        named = make_named(SHAPES[0], law)
        for sentence in (write_sentence(named), write_sentence(replace(named, shape=None))):
            assert "beyond its constant depends on the" in sentence


def test_units_of_parameters_are_those_of_the_formula() -> None:
    units = {
        shape.name: list_units(shape, BY_NAME["cart_force_by_velocity"])
        for shape in (*SHAPES, SETTLING_WAVE)
    }
    assert units["line"] == {"offset": "N", "slope": "N/(m/s)"}
    assert units["line and cube"] == {"slope": "N/(m/s)", "factor": "N/(m/s)^3"}
    assert units["bump"] == {"offset": "N", "factor": "N", "centre": "m/s", "width": "m/s"}
    spring = list_units(SHAPES[2], BY_NAME["cart_force_by_position"])
    assert spring == {"offset": "N", "factor": "N/m^2"}
