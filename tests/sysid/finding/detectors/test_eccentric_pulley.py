"""The period of a pulley off its axis is read off the balance of the force."""

import numpy as np
import pytest
from support.hidden_physics import HIDDEN, INTECO, record_hidden
from support.made_recordings import without_joint

from pendulum_sysid.finding.detectors.detector import Sight
from pendulum_sysid.finding.detectors.eccentric_pulley import read_pulley
from pendulum_sysid.prepare import prepare_case
from pendulum_twin.parameter_vector import make_theta


@pytest.mark.parametrize("seed", [1, 2])
def test_period_phase_and_size_are_near_the_truth(seed: int) -> None:
    hidden = HIDDEN["eccentric_pulley"]
    recording, _ = record_hidden({"eccentric_pulley": hidden}, seed, 20.0)
    case = prepare_case([recording], INTECO)
    ((ratio, period_m, phase_rad),) = (
        r.values for r in read_pulley(Sight(case, make_theta(case.twin)))
    )
    assert period_m == pytest.approx(hidden["period_m"], rel=0.05)
    assert ratio == pytest.approx(hidden["ratio"], rel=0.4)
    assert np.cos(phase_rad - hidden["phase_rad"]) > 0.8


def test_a_pole_alone_has_no_pulley() -> None:
    recording = without_joint(record_hidden({}, 1, 20.0)[0], "cart")
    case = prepare_case([recording], INTECO)
    assert read_pulley(Sight(case, make_theta(case.twin))) == ()
