"""The angle's scale is read off the balance of the torque, whatever the constants."""

import pytest
from support.hidden_physics import INTECO, record_hidden

from pendulum_sysid.finding.detectors.angle_scale import read_scale
from pendulum_sysid.finding.detectors.detector import Sight
from pendulum_sysid.finding.pole_alone import put_pole_on_moving_axis
from pendulum_sysid.prepare import prepare_case
from pendulum_twin.parameter_vector import make_theta

OFF = 0.025  # the reading is where a fit starts; measured: up to 0.02 off


@pytest.mark.parametrize("alone", [False, True])
@pytest.mark.parametrize("ratio", [-0.06, 0.045])
def test_the_scale_is_near_the_truth(ratio: float, alone: bool) -> None:
    """Of a rig, and of its pole alone, whose axis moves as recorded."""
    recording, _ = record_hidden({"angle_scale": {"ratio": ratio}}, 1, 20.0)
    case = whole = prepare_case([recording], INTECO)
    if alone:
        case = put_pole_on_moving_axis(whole, make_theta(whole.twin)) or whole
        assert case.signals.cart is None
    ((read,),) = (reading.values for reading in read_scale(Sight(case, make_theta(case.twin))))
    assert read == pytest.approx(ratio, abs=OFF)
