"""Ask for an effect that contains a name, where more is missing than the name."""

from dataclasses import replace

import pytest
from support.made_recordings import INTECO, made

from pendulum_sysid.finding.journal import Search
from pendulum_sysid.finding.naming import name_effects
from pendulum_sysid.fitting.fit import HORIZONS, fit
from pendulum_sysid.measuring.measure import Measured, begin_without_laws
from pendulum_sysid.measuring.wider_effects import find_wider_effects
from pendulum_sysid.prepare import prepare
from pendulum_twin.laws.law import Law
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import make_theta

RIG = Twin("rig", INTECO.rig)
DRAG = {"cart_drag_by_pole_rate": Law((-18.0, 0.0, 18.0), (1.0, 0.0, 1.0))}
SATURATION = {"input_saturation": {"limit": 0.12}}
CURRENT = {"motor_current_limit": {"limit": 0.12, "counter_share": 0.7}}


def name_saturation(hidden: dict[str, dict[str, float]]) -> Measured:
    """Return a fit of a saturation alone to a rig with these effects and a drag."""
    rig = replace(RIG, effects=hidden, measured_laws=DRAG)
    prepared = prepare([made(rig, 30.0, amplitude=0.25)], RIG)
    case, split = prepared.case, prepared.split
    start = make_theta(replace(RIG, effects=SATURATION))
    named = fit(case, split, tuple(SATURATION), start, HORIZONS[0])
    return Measured(case, split, begin_without_laws(case, split, named))


def test_a_current_limit_takes_the_place_of_a_saturation() -> None:
    measured = name_saturation(CURRENT)
    assert not measured.is_at_noise
    wider = find_wider_effects(measured, ["input_saturation"])
    assert list(wider) == ["motor_current_limit"]
    assert wider["motor_current_limit"] == pytest.approx([0.12, 0.7], rel=0.05)


def test_a_true_saturation_keeps_its_name() -> None:
    measured = name_saturation(SATURATION)
    assert not measured.is_at_noise
    assert find_wider_effects(measured, ["input_saturation"]) == {}


def test_an_effect_that_is_no_name_is_not_asked() -> None:
    assert find_wider_effects(name_saturation(CURRENT), []) == {}


@pytest.mark.parametrize("refuted", [(), ("input_saturation",)])
def test_a_name_that_gave_way_is_no_rival_of_the_wider_effect(refuted: tuple[str, ...]) -> None:
    """Without laws a saturation does nearly as well, and the verdict called both tied."""
    little = {"motor_current_limit": {"limit": 0.12, "counter_share": 0.15}}
    measured = name_saturation(little)
    start = make_theta(replace(RIG, effects=little))
    best = fit(measured.case, measured.split, tuple(little), start, HORIZONS[0])
    search = Search(measured.case, measured.split, refuted=refuted)
    bare = fit(measured.case, measured.split, (), make_theta(RIG), HORIZONS[0])
    (named,) = name_effects(search, bare, best)
    assert ("input_saturation" in named.inseparable_from) is not bool(refuted)
