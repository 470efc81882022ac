"""Inject, then find: a few known answers, one or more a place of the chain; see `support`.

All of them are diagnosed by `python tests/bench/known_answers.py`.
"""

import numpy as np
import pytest
from support.hidden_physics import HIDDEN
from support.known_answers import (
    ANSWERS,
    TRIPLE,
    diagnose_case,
    diagnose_once,
    list_intervals,
    list_mistakes,
)

from pendulum_twin.effects import BY_NAME, CATALOGUE

CHOSEN = (
    "input_dead_zone",  # command
    "belt_backlash",  # drive
    "pole_spring",  # pole
    "angle_offset",  # sensor
    "encoder_slip",  # sensor, read off the recording
    "velocity_filter",  # sensor, read off the reported velocities
    "sensor_delay",  # no motion can tell it from a delay of the command
    "nothing, seed 1",
    " + ".join(TRIPLE),  # dry friction of the cart among them
)
PLACES = {"command", "drive", "cart", "pole", "sensor"}


@pytest.mark.parametrize("name", CHOSEN)
def test_the_answer_is_right(name: str) -> None:
    assert list_mistakes(ANSWERS[name], diagnose_once(name)) == []


def test_every_place_is_among_the_chosen_effects() -> None:
    hidden = {effect for name in CHOSEN for effect in ANSWERS[name].effects}
    assert {BY_NAME[effect].place.value for effect in hidden} == PLACES


def test_every_effect_that_a_search_may_name_is_a_known_answer() -> None:
    shows_beside_friction = {"cart_friction_asymmetry"}
    nameable = {effect.name for effect in CATALOGUE if effect.searched and effect.shows_as is None}
    assert set(HIDDEN) | shows_beside_friction == nameable
    assert set(HIDDEN) <= set(ANSWERS)


def test_effects_that_no_motion_can_tell_apart_are_in_the_sentence() -> None:
    sentence = diagnose_once("sensor_delay").sentence
    assert "No motion can tell input_delay from sensor_delay." in sentence


def test_where_nothing_is_missing_the_sentence_says_what_is_enough() -> None:
    verdict = diagnose_once("nothing, seed 1")
    assert verdict.location is None and verdict.missing_physics == ()
    beginning = "Nothing is missing: other parameters of the rig are enough"
    assert verdict.sentence.startswith(beginning)


def test_a_verdict_does_not_depend_on_chance() -> None:
    first, second = (
        diagnose_function("velocity_filter").to_dict()
        for diagnose_function in (diagnose_once, diagnose_case)
    )
    assert {**first, "elapsed_s": 0.0} == {**second, "elapsed_s": 0.0}


def test_most_intervals_hold_the_truth() -> None:
    inside = [
        is_inside
        for name in CHOSEN
        for is_inside in list_intervals(ANSWERS[name], diagnose_once(name))
    ]
    assert len(inside) > 40 and np.mean(inside) >= 0.8, np.mean(inside)
