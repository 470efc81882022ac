"""Best subsets find effects that help only together, and nothing where nothing is missing."""

from dataclasses import replace

import numpy as np
import pytest
from support.hidden_physics import HIDDEN, INTECO, record_hidden

from pendulum_sysid import decisions
from pendulum_sysid.finding.journal import Search
from pendulum_sysid.finding.propose import find_largest_step, find_least_step, move_along
from pendulum_sysid.finding.subsets import find_subsets
from pendulum_sysid.fitting.fit import HORIZONS, fit
from pendulum_sysid.prepare import prepare
from pendulum_sysid.records import Fit
from pendulum_twin.effects import BY_NAME
from pendulum_twin.effects.effect import Effect
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import SLOTS, make_theta

DRY_FRICTIONS = {
    "cart_coulomb_friction",
    "cart_stribeck_friction",
    "cart_saturating_friction",
}
TOGETHER = ("input_delay", "cart_coulomb_friction", "angle_offset")


def search_hidden(names: tuple[str, ...], seed: int, twin: Twin = INTECO) -> tuple[Search, Fit]:
    recording = record_hidden({name: HIDDEN[name] for name in names}, seed, 20.0)[0]
    prepared = prepare([recording], twin)
    search = Search(prepared.case, prepared.split)
    theta = make_theta(prepared.case.twin)
    return search, fit(search.case, search.split, tuple(twin.effects), theta, HORIZONS[0])


def test_several_effects_are_found_at_once_and_their_fit_ends_near_the_noise() -> None:
    """To first order a delay looks like a lag, and an offset of the angle like a scale."""
    search, base = search_hidden(TOGETHER, 3)
    subsets = find_subsets(search, base, decisions.SUBSET_EFFECTS)
    alike = ({"input_delay", "motor_lag"}, DRY_FRICTIONS, {"angle_offset", "angle_scale"})
    assert all(set(subset.effects) & names for subset in subsets for names in alike)
    fits = [search.fit_effects(subset.effects, base, subset.theta) for subset in subsets]
    assert min(found.choose for found in fits) < 0.3 * base.choose


def test_no_set_steps_beyond_the_end_of_a_probe_that_has_shapes_alone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A limit is no size: the constants followed a step of 1.65 that the limit did not take."""
    steps: dict[str, list[float]] = {}

    def note_step(
        theta: np.ndarray, effect: Effect, target: np.ndarray, step: float, known: tuple[str, ...]
    ) -> None:
        steps.setdefault(effect.name, []).append(step)
        move_along(theta, effect, target, step, known)

    monkeypatch.setattr("pendulum_sysid.finding.subsets.move_along", note_step)
    search, base = search_hidden(("motor_current_limit",), 3)
    subsets = find_subsets(search, base, decisions.SUBSET_EFFECTS)
    assert any("motor_current_limit" in subset.effects for subset in subsets)
    for name, taken in steps.items():
        effect = BY_NAME[name]
        assert find_least_step(effect) <= min(taken) <= max(taken) <= find_largest_step(effect)


def test_no_set_holds_an_effect_beside_an_effect_that_contains_it() -> None:
    search, base = search_hidden(TOGETHER, 4)
    for subset in find_subsets(search, base, decisions.SUBSET_EFFECTS):
        for name in subset.effects:
            assert not set(BY_NAME[name].simpler) & set(subset.effects)


def test_a_set_takes_the_friction_of_the_given_twin_back_that_its_effect_contains() -> None:
    """Otherwise the level of the friction would act twice."""
    known = {"cart_coulomb_friction": {"level_n": 0.2}}
    search, base = search_hidden(
        ("cart_stribeck_friction", "input_delay"), 6, replace(INTECO, effects=known)
    )
    wider = [
        subset
        for subset in find_subsets(search, base, decisions.SUBSET_EFFECTS)
        if any("cart_coulomb_friction" in BY_NAME[name].simpler for name in subset.effects)
    ]
    assert wider
    for subset in wider:
        assert "cart_coulomb_friction" not in subset.effects
        assert np.all(subset.theta[SLOTS["cart_coulomb_friction"]] == 0.0)


def test_where_nothing_is_missing_no_set_gains_much() -> None:
    search, base = search_hidden((), 5)
    subsets = find_subsets(search, base, decisions.SUBSET_EFFECTS)
    assert all(subset.gain < 10.0 for subset in subsets)
