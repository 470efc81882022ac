"""Intervals hold the truth whichever of tied effects is there."""

import pytest
from support.made_recordings import INTECO, made
from support.tied_recordings import RIG, make_gentle_sweep, record_twin

from pendulum_sysid.finding.settled_search import search_settled
from pendulum_sysid.fitting.parameters import list_rig_parameters
from pendulum_sysid.prepare import prepare
from pendulum_sysid.records import Recording
from pendulum_twin.model import Twin

FAST_CLOCK = Twin("hidden", RIG, {"sample_period_error": {"ratio": 0.022}})
STRETCHED = Twin("hidden", RIG, {"position_scale": {"ratio": 0.03}})
GENTLE = make_gentle_sweep(20.0, 0.08)


@pytest.mark.parametrize(
    ("recording", "name"),
    [
        pytest.param(made(FAST_CLOCK, 30.0, 0.25, 1), "position_scale", id="double"),
        pytest.param(record_twin(STRETCHED, GENTLE), "pole_spring", id="tie of a gentle sweep"),
    ],
)
def test_constants_are_those_of_either_twin(recording: Recording, name: str) -> None:
    """The name that leads is the wrong one of two that fit alike; its constants are off by 5 %."""
    prepared = prepare([recording], INTECO)
    case, _, answer = search_settled(prepared.case, prepared.split, lambda line: None)
    assert [effect.effect for effect in answer.named] == [name]
    assert answer.named[0].rivals
    for constant in list_rig_parameters(case.twin):
        estimate, truth = answer.best.estimates[constant.name], getattr(RIG, constant.name)
        assert estimate.low <= truth <= estimate.high, constant.name
        assert estimate.low <= estimate.value <= estimate.high
    off = answer.best.estimates["com_distance_m"]
    assert abs(off.value / RIG.com_distance_m - 1.0) > 0.02


def test_without_a_tie_intervals_stay_narrow() -> None:
    recording = made(Twin("hidden", RIG, {"input_delay": {"delay_s": 0.01}}), 30.0, 0.25, 1)
    prepared = prepare([recording], INTECO)
    answer = search_settled(prepared.case, prepared.split, lambda line: None)[2]
    assert not answer.named[0].rivals
    estimate = answer.best.estimates["com_distance_m"]
    assert estimate.high - estimate.low < 0.01 * RIG.com_distance_m
