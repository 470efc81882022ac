"""An effect that explains most of what the laws leave without it is asked as a name."""

import functools
from dataclasses import replace

import numpy as np
import pytest
from support.made_recordings import INTECO, made

from pendulum_sysid.finding.judge import is_most_explained
from pendulum_sysid.fitting.fit import HORIZONS, fit
from pendulum_sysid.measuring.explaining_names import list_explaining
from pendulum_sysid.measuring.measure import Measured, begin_without_laws, measure_laws
from pendulum_sysid.measuring.names_beside_laws import leave_out_names
from pendulum_sysid.prepare import prepare
from pendulum_sysid.records import Estimate
from pendulum_twin.effects import BY_NAME
from pendulum_twin.laws.law import Law
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import make_theta

RIG, BEARING, SPRING = Twin("rig", INTECO.rig), "pole_coulomb_friction", "rail_spring"
RATES = np.linspace(-18.0, 18.0, 61)
DRAG = {"cart_drag_by_pole_rate": Law(tuple(RATES), tuple(0.4 * np.abs(RATES)))}


@functools.cache
def measure_beside(effect: str, size: float) -> Measured:
    """Return the laws of a rig with a drag without a name, beside an effect."""
    others = {p.name: 0.05 for p in BY_NAME[effect].parameters if p.shape}
    effects = {effect: {BY_NAME[effect].sizes[0].name: size} | others}
    rig = replace(RIG, effects=effects, measured_laws=DRAG)
    prepared = prepare([made(rig, 30.0, amplitude=0.25)], RIG)
    case, split = prepared.case, prepared.split
    start = fit(case, split, (effect,), make_theta(replace(RIG, effects=effects)), HORIZONS[0])
    held = measure_laws(case, split, begin_without_laws(case, split, start), lambda line: None)
    assert held is not None and held.kinds == tuple(DRAG)
    return held


@pytest.mark.parametrize(("level_n_m", "explains"), [(0.002, True), (2e-5, False)])
def test_what_the_laws_leave_without_an_effect_decides(level_n_m: float, explains: bool) -> None:
    held = measure_beside(BEARING, level_n_m)
    without = list_explaining(held, held.named[0], [BEARING])
    assert list(without) == [BEARING] * explains
    assert all(BEARING not in less.fit.effects for less in without.values())


def test_the_laws_have_to_make_an_effect_sure() -> None:
    held = measure_beside(BEARING, 0.002)
    fitted, key = held.named[0], f"{BEARING}.level_n_m"
    unsure = {**fitted.estimates, key: Estimate(0.002, 0.0, 0.01)}
    assert not list_explaining(held, replace(fitted, estimates=unsure), [BEARING])


def test_an_effect_that_a_law_of_its_kind_can_stand_for_is_none() -> None:
    """A cable and a brake along the rail were named a drag at a place."""
    held = measure_beside(SPRING, 1.5)
    less = leave_out_names(held, [SPRING])[SPRING]
    assert is_most_explained(held.law_fit.fit, less.fit)
    assert not list_explaining(held, held.named[0], [SPRING])
