"""Inject, then find: every effect that a diagnosis may name, hidden under noise, encoder steps and wrong parameters."""

from dataclasses import replace

import numpy as np
import pytest
from support.hidden_physics import HIDDEN, INTECO, hidden

from pendulum_sysid.fitting.split import split_windows
from pendulum_sysid.fitting.window_runs import run_windows
from pendulum_sysid.pipeline import diagnose
from pendulum_sysid.prepare import prepare_case
from pendulum_sysid.records import Recording
from pendulum_twin.effects import CATALOGUE
from pendulum_twin.model import Twin

SIZE = 0.05
AS_GOOD = 1.2  # times the score of the twin that made the recording


def verdict(effects: dict, seed: int) -> dict:
    recording, _ = hidden(effects, seed)
    return diagnose([recording], INTECO, lambda line: None).to_dict()


def held_out_score(recording: Recording, twin: Twin) -> float:
    """Return how a twin runs on the windows that a diagnosis holds out."""
    case = prepare_case([recording], INTECO)
    return run_windows(replace(case, twin=twin), split_windows(case.signals, case.state).held_out).score


def assert_sizes(found: dict, effects: dict[str, dict[str, float]]) -> None:
    for one in found["missing_physics"]:
        for name, true in effects[one["effect"]].items():
            estimate = one["parameters"][name]
            assert estimate["value"] == pytest.approx(true, rel=SIZE), (one["effect"], name)
            assert estimate["low"] <= estimate["value"] <= estimate["high"]


@pytest.mark.parametrize("effect", HIDDEN)
def test_a_hidden_effect_is_named_and_its_size_found(effect: str) -> None:
    recording, truth = hidden({effect: HIDDEN[effect]}, seed=1)
    found = diagnose([recording], INTECO, lambda line: None).to_dict()
    assert [one["effect"] for one in found["missing_physics"]] == [effect]
    assert found["outcome"] == "named"
    assert_sizes(found, {effect: HIDDEN[effect]})
    assert found["fit"]["held_out"]["after"] < AS_GOOD * held_out_score(recording, truth)
    assert found["remainder"] is None


def test_every_effect_that_a_search_may_name_is_hidden_here() -> None:
    with_others = {
        "cart_friction_asymmetry"
    }  # shows only beside a dry friction: see the pair below
    nameable = {effect.name for effect in CATALOGUE if effect.searched and effect.shows_as is None}
    assert set(HIDDEN) | with_others == nameable


@pytest.mark.parametrize(
    ("hides", "named"),
    [
        ({"sensor_delay": {"delay_s": 0.02}}, "input_delay"),
        ({"pole_imbalance": {"angle_rad": 0.03}}, "angle_offset"),
        ({"sample_period_error": {"ratio": 0.03}}, "position_scale"),
    ],
    ids=["delay", "imbalance", "clock"],
)
def test_what_no_motion_can_tell_stands_beside_the_name(hides: dict, named: str) -> None:
    found = verdict(hides, seed=1)
    assert found["outcome"] == "named"  # another recording would not help
    assert [(one["effect"], one["cannot_be_told_from"]) for one in found["missing_physics"]] == [
        (named, [*hides])
    ]
    assert f"No motion can tell {named} from {next(iter(hides))}." in found["sentence"]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_other_parameters_alone_are_no_missing_physics(seed: int) -> None:
    recording, truth = hidden({}, seed)
    found = diagnose([recording], INTECO, lambda line: None).to_dict()
    assert found["outcome"] == "nothing_missing"
    assert found["missing_physics"] == [] and found["location"] is None and found["masking"] == []
    for name, one in found["rig_parameters"].items():
        assert one["after"] == pytest.approx(getattr(truth.rig, name), rel=0.02), name
        assert one["before"] == getattr(INTECO.rig, name)


@pytest.mark.parametrize(
    "effects",
    [
        {"cart_coulomb_friction": {"level_n": 0.5}, "input_delay": {"delay_s": 0.015}},
        {
            "cart_sign_inverted": {},
            "cart_coulomb_friction": {"level_n": 0.5},
            "pole_quadratic_drag": {"n_m_s2": 2e-5},
        },
    ],
    ids=lambda effects: "+".join(effects),
)
def test_sets_of_effects_are_named_together(effects: dict) -> None:
    found = verdict(effects, seed=2)
    assert {one["effect"] for one in found["missing_physics"]} == set(effects)
    assert_sizes(found, effects)


def test_an_asymmetry_is_named_or_what_it_cannot_be_told_from() -> None:
    """Where the cart never rests, dry friction that differs by direction is dry friction and a constant force."""
    effects = {
        "cart_coulomb_friction": {"level_n": 0.5},
        "cart_friction_asymmetry": {"ratio": 0.3},
    }
    found = verdict(effects, seed=1)
    named = {one["effect"]: one["cannot_be_told_from"] for one in found["missing_physics"]}
    assert "cart_coulomb_friction" in named
    assert "cart_friction_asymmetry" in named or any(
        "cart_friction_asymmetry" in ties for ties in named.values()
    )


def test_a_masked_parameter_is_told() -> None:
    found = verdict({"cart_coulomb_friction": {"level_n": 0.5}}, seed=1)
    assert any(
        line.startswith("cart_viscous_n_s_m had absorbed the missing cart_coulomb_friction")
        for line in found["masking"]
    )


def test_what_is_found_does_not_depend_on_chance() -> None:
    first, second = (verdict({"input_dead_zone": {"width": 0.04}}, seed=3) for _ in range(2))
    for found in (first, second):
        found.pop("elapsed_s")
    assert first == second


def test_the_truth_stands_in_most_intervals() -> None:
    inside = []
    for effect in ("input_delay", "cart_coulomb_friction", "angle_offset", "cart_quadratic_drag"):
        found = verdict({effect: HIDDEN[effect]}, seed=4)
        _, truth = hidden({effect: HIDDEN[effect]}, seed=4)
        for name, one in found["rig_parameters"].items():
            inside.append(one["low"] <= getattr(truth.rig, name) <= one["high"])
        for name, true in HIDDEN[effect].items():
            one = found["missing_physics"][0]["parameters"][name]
            inside.append(one["low"] <= true <= one["high"])
    assert np.mean(inside) >= 0.8, inside
