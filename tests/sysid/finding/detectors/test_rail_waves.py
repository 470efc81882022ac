"""The period of a wave along the rail is read off the balance of the force."""

import numpy as np
import pytest
from support.hidden_physics import HIDDEN, INTECO, record_hidden
from support.made_recordings import without_joint

from pendulum_sysid.finding.detectors.detector import Sight
from pendulum_sysid.finding.detectors.rail_waves import read_cogging, read_ripple
from pendulum_sysid.prepare import prepare_case
from pendulum_twin.parameter_vector import make_theta


@pytest.mark.parametrize("seed", [1, 2])
def test_period_phase_and_size_of_a_ripple_are_near_the_truth(seed: int) -> None:
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


@pytest.mark.parametrize("period_m", [0.03, 0.071, 0.21])
def test_period_and_phase_of_cogging_are_near_the_truth(period_m: float) -> None:
    hidden = {"amplitude_n": 0.5, "period_m": period_m, "phase_rad": 0.7}
    friction = {"level_n": 0.4}
    recording, _ = record_hidden({"cogging": hidden, "cart_coulomb_friction": friction}, 3, 30.0)
    case = prepare_case([recording], INTECO)
    ((amplitude_n, read_m, phase_rad),) = (
        r.values for r in read_cogging(Sight(case, make_theta(case.twin)))
    )
    waves = np.ptp(recording.signals.cart) / np.array([read_m, period_m])
    assert abs(waves[0] - waves[1]) < 0.3  # a fit gets into step from there
    assert amplitude_n > 0.2
    assert np.cos(phase_rad - hidden["phase_rad"]) > 0.5


def test_a_pole_alone_has_no_wave() -> None:
    recording = without_joint(record_hidden({}, 1, 20.0)[0], "cart")
    case = prepare_case([recording], INTECO)
    assert read_ripple(Sight(case, make_theta(case.twin))) == ()
    assert read_cogging(Sight(case, make_theta(case.twin))) == ()
