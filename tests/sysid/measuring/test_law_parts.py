"""Effects that a measured law of the sensor holds as parts."""

from dataclasses import replace

import numpy as np
import pytest
from support.hidden_physics import INTECO
from support.made_recordings import made

from pendulum_sysid.fitting.fit import fit_own_parameters
from pendulum_sysid.measuring.further_law import fit_longer
from pendulum_sysid.measuring.law_parts import give_parts_back
from pendulum_sysid.measuring.measure import (
    Measured,
    begin_without_laws,
    measure_laws,
)
from pendulum_sysid.measuring.ranking import rank_curves
from pendulum_sysid.prepare import prepare
from pendulum_twin.laws.law import Law
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import SLOTS

RIG = Twin("rig", INTECO.rig)
TURN = 2 * np.pi * np.arange(24) / 24
DISC = "angle_error_over_turn"


def test_the_mean_of_an_angles_error_is_an_offset_in_every_recording():
    """Of two recordings of a rig, one started without names and held the offset in its law."""
    law = Law(tuple(TURN), tuple(-0.05 + 0.02 * np.sin(2 * TURN + 0.4)))
    recording = made(replace(RIG, measured_laws={DISC: law}), 30.0, amplitude=0.25)
    prepared = prepare([recording], RIG)
    case, split = prepared.case, prepared.split
    begun = begin_without_laws(case, split, fit_own_parameters(case, split))
    measured = measure_laws(case, split, begun, lambda line: None)
    assert measured is not None and measured.kinds == (DISC,)
    assert give_parts_back(measured, ("cart_coulomb_friction",)) is measured

    back = give_parts_back(measured, ("angle_offset",))
    fit = back.law_fit.fit
    assert fit.effects == ("angle_offset",) and back.kinds == (DISC,)
    assert fit.theta[SLOTS["angle_offset"]] == pytest.approx(-0.05, abs=0.002)
    assert np.mean(back.law_fit.values[0]) == pytest.approx(0.0, abs=1e-6)
    assert fit.choose < 1.02 * measured.law_fit.fit.choose
    assert give_parts_back(back, ("angle_offset",)) is back


def test_a_law_that_is_all_a_part_goes():
    """A scale of the position is the slope of its error; an eccentric pulley is no part."""
    scaled = replace(RIG, effects={"position_scale": {"ratio": 0.03}})
    prepared = prepare([made(scaled, 20.0, amplitude=0.25)], RIG)
    case, split = prepared.case, prepared.split
    begun = begin_without_laws(case, split, fit_own_parameters(case, split))
    likely = {ranked.curve.kind.name: ranked for ranked in rank_curves(case, split, begun)}
    longer = fit_longer(case, split, begun, likely["position_error_along_rail"])

    back = give_parts_back(Measured(case, split, longer), ("eccentric_pulley", "position_scale"))
    assert back.law_fit.fit.effects == ("position_scale",) and back.kinds == ()
    assert back.law_fit.fit.theta[SLOTS["position_scale"]] == pytest.approx(0.03, abs=0.002)
