"""Where believed sets hold one force under two names, both are told."""

from dataclasses import replace

import pytest
from support.made_recordings import INTECO, made

from pendulum_sysid.finding.judge import Lead
from pendulum_sysid.finding.naming import Named, weigh_name
from pendulum_sysid.finding.stand_ins import StandIn, list_stand_ins
from pendulum_sysid.finding.weights import WeighedSet
from pendulum_sysid.fitting.fit import HORIZONS, fit
from pendulum_sysid.prepare import prepare
from pendulum_twin.parameter_vector import SLOTS, make_theta

DELAY = {"input_delay": {"delay_s": 0.02}}
LAG = {"motor_lag": {"time_constant_s": 0.02}, "rail_tilt": {"angle_rad": 0.001}}


@pytest.fixture(scope="module")
def delayed():
    """Return the case of a delayed rig, the fit of the delay, and the fit of a lag and a tilt."""
    prepared = prepare([made(replace(INTECO, effects=DELAY), 20.0, amplitude=0.3)], INTECO)
    case, split = prepared.case, prepared.split
    fits = [
        fit(case, split, tuple(e), make_theta(replace(INTECO, effects=e)), HORIZONS[0])
        for e in (DELAY, LAG)
    ]
    return case, *fits


def test_a_lag_stands_in_for_a_delay_and_what_is_beside_it_does_not(delayed):
    case, best, other = delayed
    sets = (WeighedSet(best.effects, 0.6, best.theta), WeighedSet(other.effects, 0.4, other.theta))
    assert list_stand_ins(case, best, sets, "input_delay") == (StandIn("motor_lag", sets[1]),)


def test_the_same_effect_of_another_size_does_not_stand_in(delayed):
    """A lag ten times as long is another force."""
    case, best, other = delayed
    theta = other.theta.copy()
    theta[SLOTS["motor_lag"]] *= 10.0
    sets = (
        WeighedSet(best.effects, 0.4, best.theta),
        WeighedSet(other.effects, 0.05, other.theta),
        WeighedSet(("motor_lag",), 0.55, theta),
    )
    assert [s.within for s in list_stand_ins(case, best, sets, "input_delay")] == [sets[1]]
    named = weigh_name(case, best, sets, Named("input_delay", Lead(2.0, 5.0)))
    assert named.weight == pytest.approx(0.4) and named.inseparable_from == ()


@pytest.mark.parametrize(
    ("weights", "told", "ties"),
    [
        ((0.6, 0.4, 0.0), 1.0, ("motor_lag",)),
        ((0.8, 0.2, 0.0), 0.8, ()),
        ((0.3, 0.3, 0.4), 0.3, ()),
    ],
    ids=["both together are believed", "the delay alone is", "both together are not"],
)
def test_a_name_counts_with_its_stand_ins_where_it_is_not_believed_alone(
    delayed, weights, told, ties
):
    case, best, other = delayed
    sets = (
        WeighedSet(best.effects, weights[0], best.theta),
        WeighedSet(other.effects, weights[1], other.theta),
        WeighedSet((), weights[2]),
    )
    named = weigh_name(case, best, sets, Named("input_delay", Lead(2.0, 5.0)))
    assert named.weight == pytest.approx(told) and named.inseparable_from == ties
