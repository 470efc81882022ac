"""Old commands and silent rigs are found, whatever the clock does."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pendulum_bridge.safety.reasons import Level, Reason
from pendulum_bridge.safety.watchdog import (
    Ages,
    Timeouts,
    aged,
    command_came,
    command_forgotten,
    command_missing,
    passed_s,
    sample_came,
    silence,
)
from pendulum_twin.errors import BadInputError

LIMITS = Timeouts()


def heard(now_s: float) -> Ages:
    return sample_came(command_came(Ages(now_s)))


def test_nothing_heard_yet() -> None:
    assert silence(Ages(5.0), LIMITS) is Reason.NO_SAMPLE_YET
    assert command_missing(Ages(5.0), LIMITS) is Reason.NO_COMMAND_YET


@pytest.mark.parametrize(
    ("later_s", "old"), [(0.0, False), (0.19, False), (0.21, True), (1e9, True)]
)
def test_both_are_old_after_two_tenths_of_a_second(later_s: float, old: bool) -> None:
    ages = aged(heard(7.0), 7.0 + later_s)
    assert command_missing(ages, LIMITS) is (Reason.COMMAND_OLD if old else None)
    assert silence(ages, LIMITS) is (Reason.RIG_SILENT if old else None)


def test_old_is_an_error() -> None:
    assert {Reason.COMMAND_OLD.level, Reason.RIG_SILENT.level, Reason.NO_SAMPLE_YET.level} == {
        Level.ERROR
    }


def test_each_is_renewed_by_its_own_kind_alone() -> None:
    old = aged(heard(0.0), 1.0)
    assert command_missing(sample_came(old), LIMITS) is Reason.COMMAND_OLD
    assert silence(command_came(old), LIMITS) is Reason.RIG_SILENT
    assert command_missing(command_forgotten(heard(0.0)), LIMITS) is Reason.NO_COMMAND_YET


def test_a_clock_that_jumps_back_makes_nothing_young_and_nothing_eternal() -> None:
    ages = aged(aged(heard(1000.0), 1000.15), 3.0)  # a thousand seconds back
    assert passed_s(ages, 2.0) == 0.0
    assert ages.command_s == pytest.approx(0.15) and command_missing(ages, LIMITS) is None
    assert command_missing(aged(ages, 3.1), LIMITS) is Reason.COMMAND_OLD


@given(st.lists(st.floats(-1e3, 1e3), max_size=5), st.integers(0, 20))
def test_after_any_jumps_a_command_dies_within_its_time_and_a_look_for_each_jump(
    jumps: list[float], every: int
) -> None:
    period, now = 0.01, 500.0
    ages, looks = heard(now), 0
    pending = list(jumps)
    while command_missing(ages, LIMITS) is None:
        looks += 1
        now += period
        if pending and looks % (every + 1) == 0:
            now += pending.pop()
        ages = aged(ages, now)
    assert looks * period <= LIMITS.command_s + (len(jumps) + 2) * period


@pytest.mark.parametrize("wrong", [0.0, -1.0, math.nan, math.inf])
def test_a_timeout_that_is_none_is_refused(wrong: float) -> None:
    with pytest.raises(BadInputError, match="rig timeout: expected a number of seconds above 0"):
        Timeouts(0.2, wrong)
    with pytest.raises(BadInputError, match="command timeout"):
        Timeouts(command_s=wrong)


def test_a_command_between_two_looks_at_the_clock_is_as_old_as_it_is() -> None:
    ages = command_came(Ages(7.0), 7.015)
    assert aged(ages, 7.02).command_s == pytest.approx(0.005)
    assert command_came(Ages(7.0), 6.0).command_s == 0.0  # the clock jumped back
