"""A load and its instant are read off the balance of the force, whatever the constants."""

from dataclasses import replace

import pytest
from support.hidden_physics import INTECO, record_hidden
from support.made_recordings import without_joint

from pendulum_sysid.finding.detectors.detector import Sight
from pendulum_sysid.finding.detectors.load_put_on import read_load
from pendulum_sysid.prepare import prepare_case
from pendulum_twin.parameter_vector import make_theta


@pytest.mark.parametrize(("load_kg", "time_s"), [(0.15, 17.3), (-0.1, 6.0)])
def test_the_instant_is_the_truth(load_kg: float, time_s: float) -> None:
    effects = {"load_put_on": {"load_kg": load_kg, "time_s": time_s}}
    recording, truth = record_hidden(effects, 1, 20.0)
    theta = make_theta(replace(truth, effects={}))
    ((load, instant),) = (
        r.values for r in read_load(Sight(prepare_case([recording], INTECO), theta))
    )
    assert instant == pytest.approx(time_s, abs=0.05)
    assert load == pytest.approx(load_kg, rel=0.4)  # the twin moves as without the load


def test_a_pole_alone_has_no_load() -> None:
    recording = without_joint(record_hidden({}, 1, 20.0)[0], "cart")
    case = prepare_case([recording], INTECO)
    assert read_load(Sight(case, make_theta(case.twin))) == ()
