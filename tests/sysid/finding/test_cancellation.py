"""Effects that take each other back are no names, however surely the fit holds them."""

from dataclasses import replace

import numpy as np
import pytest
from support.made_recordings import INTECO, made

from pendulum_sysid.finding.cancellation import list_cancelled
from pendulum_sysid.fitting.fit import HORIZONS, fit
from pendulum_sysid.prepare import prepare
from pendulum_twin.laws.law import Law, spread_turn
from pendulum_twin.parameter_vector import make_theta

BUILT = {
    "angle_offset": {"angle_rad": -0.05},
    "angle_scale": {"ratio": 0.016},
    "eccentric_encoder": {"sine_rad": 0.028, "cosine_rad": 0.006},
}


def fit_to(truth, effects, amplitude):
    """Return case and fit of effects to the motion of a rig."""
    prepared = prepare([made(truth, 30.0, amplitude=amplitude)], INTECO)
    case, split = prepared.case, prepared.split
    start = make_theta(replace(INTECO, effects=effects))
    return case, fit(case, split, tuple(effects), start, HORIZONS[0])


def test_an_error_of_two_waves_a_turn_is_built_from_effects_that_cancel():
    """Beside a hanging pole an offset and a scale, 40 mrad each, leave 2 % of their power."""
    turn = spread_turn(24)
    disc = Law(tuple(turn), tuple(0.0055 * np.sin(2 * turn)))
    case, built = fit_to(
        replace(INTECO, measured_laws={"angle_error_over_turn": disc}), BUILT, 0.15
    )
    assert {"angle_offset", "angle_scale"} <= list_cancelled(case, built)


@pytest.mark.parametrize(
    "effects",
    [
        {"angle_offset": {"angle_rad": 0.05}, "eccentric_encoder": BUILT["eccentric_encoder"]},
        {"angle_offset": {"angle_rad": -0.05}, "angle_scale": {"ratio": 0.05}},
        {"cart_coulomb_friction": {"level_n": 0.5}, "rail_tilt": {"angle_rad": 0.01}},
        {"gain_asymmetry": {"ratio": 0.1}, "rail_tilt": {"angle_rad": -0.02}},
        {"cart_coulomb_friction": {"level_n": 0.6}, "input_dead_zone": {"width": 0.03}},
        {"pole_coulomb_friction": {"level_n_m": 0.003}, "pole_quadratic_drag": {"n_m_s2": 3e-4}},
    ],
    ids=lambda effects: " and ".join(effects),
)
def test_effects_that_are_there_do_not_cancel(effects):
    case, both = fit_to(replace(INTECO, effects=effects), effects, 0.3)
    assert list_cancelled(case, both) == frozenset()
