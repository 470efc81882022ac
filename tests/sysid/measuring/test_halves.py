"""A law of one half of the time has to hold in the other half."""

from dataclasses import replace

import numpy as np
import pytest
from support.made_recordings import INTECO, made

from pendulum_sysid import decisions
from pendulum_sysid.fitting.fit import HORIZONS, fit
from pendulum_sysid.measuring.curve import Curve
from pendulum_sysid.measuring.halves import is_seen_in_halves
from pendulum_sysid.measuring.measure import rank_curves
from pendulum_sysid.measuring.penalised_fit import LawFit, fit_laws
from pendulum_sysid.prepare import prepare
from pendulum_twin.laws.law import Law, spread_turn
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import make_theta

RIG = Twin("rig", INTECO.rig)
TURN = spread_turn(24)
LAW = {"pole_torque_by_angle": Law(tuple(TURN), tuple(0.01 * np.sin(3.0 * TURN)))}


@pytest.mark.parametrize(("laws", "holds"), [((LAW, LAW), True), ((LAW, {}), False)])
def test_a_law_that_only_one_half_shows_does_not_hold(laws, holds):
    twins = [replace(RIG, measured_laws=law) for law in laws]
    prepared = prepare([made(twin, 16.0, amplitude=0.25) for twin in twins], RIG)
    case, split = prepared.case, prepared.split
    begun = fit(case, split, (), make_theta(RIG), HORIZONS[0])
    shorter = LawFit(begun, (), (), (), (), decisions.LAW_FIRST_INFLATION)
    (candidate,) = [
        r for r in rank_curves(case, split, shorter) if r.curve.kind.name == "pole_torque_by_angle"
    ]
    curve: Curve = candidate.curve
    theta = shorter.fit.theta.copy()
    curve.put(theta, candidate.values)
    start = replace(shorter.fit, theta=theta)
    longer = fit_laws(case, split, start, (curve,), (candidate.prior,), shorter.inflation)
    assert is_seen_in_halves(case, split, longer, shorter) is holds
