"""What comes again of an error is told from what is random, where a motion is played twice."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from support.made_recordings import INTECO, PERIOD_S, made, made_states, sweep

from pendulum_sysid.errors import WrongUse
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.measuring.repeatability import find_repeated_windows, measure_repeatability
from pendulum_sysid.planning.repeating import LONGEST_REST_S, QUIET, repeat_plan
from pendulum_sysid.prepare import prepare
from pendulum_sysid.records import Recording
from pendulum_twin.model import Twin
from pendulum_twin.plans.plan_file import Plan
from pendulum_twin.plans.plan_phases import Push, Rest
from pendulum_twin.signals import Signals

PULLED = replace(INTECO, effects={"rail_spring": {"n_per_m": 3.0, "centre_m": 0.1}})
SECONDS = 15.0
RUN = round(SECONDS / PERIOD_S)


def play_again(truth: Twin, gusts_m: float = 0.0, times: int = 2) -> Recording:
    """Return so many runs of one command, each from hanging at rest.

    gusts_m: deviation of what shakes the cart's place, anew in each run, over tenths of a second.
    """
    command = sweep(SECONDS, 0.1)
    states = np.concatenate([made_states(truth, command)] * times)
    random = np.random.default_rng(4)
    n = len(states)
    gusts = np.interp(np.arange(n), np.arange(0, n, 20), random.normal(size=n // 20))
    cart = states[:, 0] + gusts_m * gusts + random.normal(0.0, 5e-5, n)
    pole = states[:, 1] + random.normal(0.0, 1e-3, n)
    every = np.ones(n, dtype=bool)
    signals = Signals(
        PERIOD_S,
        np.tile(command, times),
        cart,
        pole,
        every,
        every,
        stretch_begins=tuple(RUN * np.arange(times)),
    )
    return Recording("again", "sha256:2", signals)


def make_case(recording: Recording) -> Case:
    return prepare([recording], INTECO).case


def test_a_motion_that_is_played_twice_is_found_again() -> None:
    first, again, _ = find_repeated_windows(make_case(play_again(INTECO)))
    assert len(first) > 7
    assert np.all(np.abs(np.abs(again - first) - RUN) <= 2)
    assert len(np.unique(np.minimum(first, again) // (RUN // 15))) == len(first)  # each pair once


def test_a_force_that_depends_on_the_place_comes_again() -> None:
    measured = measure_repeatability(make_case(play_again(PULLED)))
    assert measured is not None
    assert measured.low > 0.95 and measured.low <= measured.share <= measured.high


def test_no_more_windows_come_again_than_the_recording_holds() -> None:
    """A window that stands in several pairs counted in each: 94 windows of 59 came again."""
    case = make_case(play_again(PULLED, times=4))
    first, again, _ = find_repeated_windows(case)
    measured = measure_repeatability(case)
    windows = set(np.round(np.concatenate([first, again]) * PERIOD_S).tolist())
    assert len(windows) < 2 * len(first)
    assert measured is not None and measured.windows == len(windows)


def test_what_shakes_the_rig_does_not_come_again() -> None:
    measured = measure_repeatability(make_case(play_again(INTECO, gusts_m=2e-3)))
    assert measured is not None
    assert measured.share < 0.3


def test_both_at_once_are_parted() -> None:
    """What may be random is the error that the gusts alone make."""
    both = measure_repeatability(make_case(play_again(PULLED, gusts_m=2e-3)))
    gusts = measure_repeatability(make_case(play_again(INTECO, gusts_m=2e-3)))
    assert both is not None and gusts is not None
    assert gusts.high < both.share < 1.0
    assert both.random == pytest.approx(gusts.random, rel=0.3)


def test_a_motion_that_is_played_once_says_nothing() -> None:
    assert measure_repeatability(make_case(made(INTECO, seconds=20.0))) is None


def test_a_slow_motion_is_not_found_again_a_moment_later() -> None:
    """It grows all along, so that it never comes again."""
    t = np.arange(2000) * 0.01
    place = (1.0 + 0.15 * t) * np.sin(0.4 * np.pi * t)
    rate, still, every = np.gradient(place, t), np.zeros(2000), np.ones(2000, dtype=bool)
    signals = Signals(0.01, still, place, None, every, ~every)
    state = SimpleNamespace(states=np.stack([place, still, rate, still], axis=1))
    first, again, _ = find_repeated_windows(SimpleNamespace(signals=signals, state=state))  # type: ignore[arg-type]
    assert len(first) == len(again) == 0


def test_a_plan_is_repeated_after_the_pole_has_swung_out() -> None:
    plan = Plan((Push(), Rest(seconds=2.0)), "short")
    rig = INTECO.rig
    twice = repeat_plan(plan, rig)
    assert twice.phases[:2] == twice.phases[-2:] == plan.phases
    rest = twice.phases[2]
    assert isinstance(rest, Rest) and 1.0 < rest.seconds <= LONGEST_REST_S
    left = np.exp(
        -0.5 * (rig.pole_viscous_n_m_s or 0.0) / (rig.pole_inertia_kg_m2 or 1.0) * rest.seconds
    )
    assert left == pytest.approx(QUIET, rel=0.1)


def test_a_plan_too_long_to_be_played_twice_is_refused() -> None:
    plan = Plan((Push(), Rest(seconds=1790.0)), "long")
    with pytest.raises(WrongUse, match=r"may be played twice, found .*at most 3600 s"):
        repeat_plan(plan, INTECO.rig)
