"""The step of a coarse command is read off the balance of the force, whatever the constants."""

import pytest
from support.hidden_physics import HIDDEN, INTECO, record_hidden
from support.made_recordings import without_joint

from pendulum_sysid.finding.detectors.coarse_command import read_step
from pendulum_sysid.prepare import prepare_case
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import make_theta


@pytest.mark.parametrize("delay_s", [0.0, 0.013])
def test_the_step_is_the_truth(delay_s: float) -> None:
    late = {"input_delay": {"delay_s": delay_s}} if delay_s else {}
    recording, _ = record_hidden({**late, "coarse_command": HIDDEN["coarse_command"]}, 1, 20.0)
    case = prepare_case([recording], INTECO)
    ((step,),) = (r.values for r in read_step(case, make_theta(Twin("t", INTECO.rig, late))))
    assert step == pytest.approx(HIDDEN["coarse_command"]["step"], rel=2e-3)


def test_a_pole_alone_has_no_command() -> None:
    recording = without_joint(record_hidden({}, 1, 20.0)[0], "cart")
    case = prepare_case([recording], INTECO)
    assert read_step(case, make_theta(case.twin)) == ()
