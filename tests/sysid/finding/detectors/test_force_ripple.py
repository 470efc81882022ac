"""The period of a ripple is read off the balance of the force, whatever the constants."""

import numpy as np
import pytest
from support.hidden_physics import HIDDEN, INTECO, record_hidden
from support.made_recordings import without_joint

from pendulum_sysid.finding.detectors.detector import Sight
from pendulum_sysid.finding.detectors.force_ripple import read_ripple
from pendulum_sysid.prepare import prepare_case
from pendulum_twin.parameter_vector import make_theta


@pytest.mark.parametrize("seed", [1, 2])
def test_period_phase_and_size_are_near_the_truth(seed: int) -> None:
    hidden = HIDDEN["force_ripple"]
    recording, truth = record_hidden({"force_ripple": hidden}, seed, 20.0)
    case = prepare_case([recording], INTECO)
    ((ratio, period_m, phase_rad),) = (
        r.values for r in read_ripple(Sight(case, make_theta(case.twin)))
    )
    assert period_m == pytest.approx(hidden["period_m"], rel=0.02)
    # a ratio of the twin's force per command, which is not the rig's
    force_n = ratio * INTECO.rig.force_per_pwm_n / truth.rig.force_per_pwm_n
    assert force_n == pytest.approx(hidden["ratio"], rel=0.15)
    assert np.cos(phase_rad - hidden["phase_rad"]) > 0.9


def test_a_pole_alone_has_no_ripple() -> None:
    recording = without_joint(record_hidden({}, 1, 20.0)[0], "cart")
    case = prepare_case([recording], INTECO)
    assert read_ripple(Sight(case, make_theta(case.twin))) == ()
