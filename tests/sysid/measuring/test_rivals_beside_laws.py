"""Beside the law of what had no name, a rival in the place of a name is outdone."""

from dataclasses import replace

import numpy as np
from support.made_recordings import INTECO, made

from pendulum_sysid.finding.judge import Lead, is_outdone
from pendulum_sysid.finding.naming import Named
from pendulum_sysid.fitting.fit import HORIZONS, fit
from pendulum_sysid.measuring.measure import Measured, begin_without_laws, measure_laws
from pendulum_sysid.measuring.rivals_beside_laws import ask_rivals_again
from pendulum_sysid.prepare import prepare
from pendulum_twin.laws.law import Law
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import make_theta

RIG = Twin("rig", INTECO.rig)
RATES = np.linspace(-18.0, 18.0, 61)
DRAG = {"cart_drag_by_pole_rate": Law(tuple(RATES), tuple(0.4 * np.abs(RATES)))}
CONCEALED = {"cart_coulomb_friction": {"level_n": 0.5}}
RIVAL = {"input_saturation": {"limit": 0.2}}


def test_a_law_settles_which_of_two_effects_is_there() -> None:
    rig = replace(RIG, effects=CONCEALED, measured_laws=DRAG)
    prepared = prepare([made(rig, 30.0, amplitude=0.25)], RIG)
    case, split = prepared.case, prepared.split
    best, other = (
        fit(case, split, tuple(effects), make_theta(replace(RIG, effects=effects)), HORIZONS[0])
        for effects in (CONCEALED, RIVAL)
    )
    begun = begin_without_laws(case, split, best)
    assert not is_outdone(other, best)  # the drag hides which of the two is there
    tied = ("input_saturation", "cart_load_friction")
    named = Named("cart_coulomb_friction", Lead(np.inf, np.inf), tied, rivals=(other,))
    (alike,) = ask_rivals_again(Measured(case, split, begun), (named,))
    assert alike.inseparable_from == tied
    measured = measure_laws(case, split, begun, lambda line: None)
    assert measured is not None and measured.kinds == ("cart_drag_by_pole_rate",)
    (settled,) = ask_rivals_again(measured, (named,))
    assert settled.inseparable_from == ("cart_load_friction",)  # no fit shows that it is outdone
    assert settled.rivals == ()
