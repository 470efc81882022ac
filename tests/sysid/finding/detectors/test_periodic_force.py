"""The frequency of a vibration is read off the balance of the force, whatever the constants."""

import numpy as np
import pytest
from support.hidden_physics import HIDDEN, INTECO, record_hidden
from support.made_recordings import without_joint

from pendulum_sysid.finding.detectors.detector import Sight
from pendulum_sysid.finding.detectors.periodic_force import read_vibration
from pendulum_sysid.prepare import prepare_case
from pendulum_twin.parameter_vector import make_theta


@pytest.mark.parametrize("seed", [1, 2])
def test_frequency_phase_and_size_are_near_the_truth(seed: int) -> None:
    hidden = HIDDEN["periodic_force"]
    recording, _ = record_hidden({"periodic_force": hidden}, seed, 20.0)
    case = prepare_case([recording], INTECO)
    ((amplitude_n, frequency_hz, phase_rad),) = (
        reading.values for reading in read_vibration(Sight(case, make_theta(case.twin)))
    )
    assert frequency_hz == pytest.approx(hidden["frequency_hz"], abs=0.2 / 20.0)
    assert amplitude_n == pytest.approx(hidden["amplitude_n"], rel=0.2)
    assert np.cos(phase_rad - hidden["phase_rad"]) > 0.9


def test_a_pole_alone_has_no_force_on_a_cart() -> None:
    recording = without_joint(record_hidden({}, 1, 20.0)[0], "cart")
    case = prepare_case([recording], INTECO)
    assert read_vibration(Sight(case, make_theta(case.twin))) == ()
