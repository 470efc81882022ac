"""An effect that explains most of what the laws leave without it is asked as a name."""

from dataclasses import replace

import numpy as np
import pytest
from support.made_recordings import INTECO, made

from pendulum_sysid.fitting.fit import HORIZONS, fit
from pendulum_sysid.measuring.explaining_names import list_explaining
from pendulum_sysid.measuring.measure import Measured, begin_without_laws, measure_laws
from pendulum_sysid.prepare import prepare
from pendulum_sysid.records import Estimate
from pendulum_twin.laws.law import Law
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import SLOTS, make_theta

RIG, SPRING, PATCH = Twin("rig", INTECO.rig), "rail_spring", "rail_drag_patch"
RATES = np.linspace(-18.0, 18.0, 61)
DRAG = {"cart_drag_by_pole_rate": Law(tuple(RATES), tuple(0.4 * np.abs(RATES)))}


def measure_beside_spring(n_per_m: float) -> Measured:
    """Return the laws of a rig with a drag without a name, beside a spring of the rail."""
    effects = {SPRING: {"n_per_m": n_per_m, "centre_m": 0.05}}
    rig = replace(RIG, effects=effects, measured_laws=DRAG)
    prepared = prepare([made(rig, 30.0, amplitude=0.25)], RIG)
    case, split = prepared.case, prepared.split
    theta = make_theta(replace(RIG, effects=effects))
    start = fit(case, split, (SPRING,), theta, HORIZONS[0])
    held = measure_laws(case, split, begin_without_laws(case, split, start), lambda line: None)
    assert held is not None and held.kinds == tuple(DRAG)
    return held


@pytest.mark.parametrize(("n_per_m", "explains"), [(1.5, True), (0.01, False)])
def test_what_the_laws_leave_without_an_effect_decides(n_per_m: float, explains: bool) -> None:
    held = measure_beside_spring(n_per_m)
    without = list_explaining(held, held.named[0], [SPRING])
    assert list(without) == [SPRING] * explains
    assert all(SPRING not in less.fit.effects for less in without.values())


def test_the_laws_have_to_make_an_effect_sure() -> None:
    held = measure_beside_spring(1.5)
    fitted = held.named[0]
    key = f"{SPRING}.n_per_m"
    unsure = replace(fitted, estimates={**fitted.estimates, key: Estimate(1.5, -0.5, 3.5)})
    assert list_explaining(held, fitted, [SPRING])
    assert not list_explaining(held, unsure, [SPRING])


@pytest.mark.parametrize(("away_m", "explains"), [(0.0, True), (0.1, False)])
def test_a_law_in_the_place_of_an_effect_shows_its_shape(away_m: float, explains: bool) -> None:
    """A cable that drags more the further the cart is was named a drag at a place.

    away_m: how far the fit has the drag from its place, which no law follows.
    """
    effects = {PATCH: {"n_s_per_m": 3.0, "centre_m": 0.12, "width_m": 0.08}}
    rig = replace(RIG, effects=effects)
    prepared = prepare([made(rig, 30.0, amplitude=0.25)], RIG)
    case, split = prepared.case, prepared.split
    law_fit = begin_without_laws(case, split, fit(case, split, (PATCH,), make_theta(rig)))
    theta = law_fit.fit.theta.copy()
    theta[SLOTS[PATCH].start + 1] += away_m
    law_fit = replace(law_fit, fit=replace(law_fit.fit, theta=theta))
    held = Measured(case, split, law_fit)
    assert list(list_explaining(held, law_fit.fit, [PATCH])) == [PATCH] * explains
