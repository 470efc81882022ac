"""Old commands and silent rigs are found, whatever the clock does."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pendulum_bridge.safety.reasons import Level, Reason
from pendulum_bridge.safety.watchdog import (
    Ages,
    Timeouts,
    advance_ages,
    compute_passed_s,
    find_missing_command,
    find_silence,
    forget_command,
    note_command,
    note_sample,
)
from pendulum_twin.errors import BadInputError

LIMITS = Timeouts()


def heard(now_s: float) -> Ages:
    return note_sample(note_command(Ages(now_s)))


def test_nothing_heard_yet() -> None:
    assert find_silence(Ages(5.0), LIMITS) is Reason.NO_SAMPLE_YET
    assert find_missing_command(Ages(5.0), LIMITS) is Reason.NO_COMMAND_YET


@pytest.mark.parametrize(
    ("later_s", "old"), [(0.0, False), (0.19, False), (0.21, True), (1e9, True)]
)
def test_both_are_old_after_two_tenths_of_a_second(later_s: float, old: bool) -> None:
    ages = advance_ages(heard(7.0), 7.0 + later_s)
    assert find_missing_command(ages, LIMITS) is (Reason.COMMAND_OLD if old else None)
    assert find_silence(ages, LIMITS) is (Reason.RIG_SILENT if old else None)


def test_each_has_its_own_timeout() -> None:
    ages = advance_ages(heard(0.0), 0.3)
    assert find_silence(ages, Timeouts(command_s=0.1, sample_s=0.5)) is None
    assert find_missing_command(ages, Timeouts(command_s=0.5, sample_s=0.1)) is None


def test_old_is_an_error() -> None:
    assert {Reason.COMMAND_OLD.level, Reason.RIG_SILENT.level, Reason.NO_SAMPLE_YET.level} == {
        Level.ERROR
    }


def test_each_is_renewed_by_its_own_kind_alone() -> None:
    old = advance_ages(heard(0.0), 1.0)
    assert find_missing_command(note_sample(old), LIMITS) is Reason.COMMAND_OLD
    assert find_silence(note_command(old), LIMITS) is Reason.RIG_SILENT
    assert find_missing_command(forget_command(heard(0.0)), LIMITS) is Reason.NO_COMMAND_YET


def test_a_clock_that_jumps_back_makes_nothing_young_and_nothing_eternal() -> None:
    ages = advance_ages(advance_ages(heard(1000.0), 1000.15), 3.0)  # a thousand seconds back
    assert compute_passed_s(ages, 2.0) == 0.0
    assert ages.command_s == pytest.approx(0.15) and find_missing_command(ages, LIMITS) is None
    assert find_missing_command(advance_ages(ages, 3.1), LIMITS) is Reason.COMMAND_OLD


@given(st.lists(st.floats(-1e3, 1e3), max_size=5), st.integers(0, 20))
def test_after_any_jumps_a_command_dies_within_its_time_and_a_look_for_each_jump(
    jumps: list[float], every: int
) -> None:
    period, now = 0.01, 500.0
    ages, looks = heard(now), 0
    pending = list(jumps)
    while find_missing_command(ages, LIMITS) is None:
        looks += 1
        now += period
        if pending and looks % (every + 1) == 0:
            now += pending.pop()
        ages = advance_ages(ages, now)
    assert looks * period <= LIMITS.command_s + (len(jumps) + 2) * period


@pytest.mark.parametrize("wrong", [0.0, -1.0, math.nan, math.inf])
def test_a_timeout_that_is_none_is_refused(wrong: float) -> None:
    with pytest.raises(BadInputError, match="rig timeout: expected a number of seconds above 0"):
        Timeouts(0.2, wrong)
    with pytest.raises(BadInputError, match="command timeout"):
        Timeouts(command_s=wrong)


def test_a_command_between_two_looks_at_the_clock_is_as_old_as_it_is() -> None:
    ages = note_command(Ages(7.0), 7.015)
    assert advance_ages(ages, 7.02).command_s == pytest.approx(0.005)
    assert note_command(Ages(7.0), 6.0).command_s == 0.0  # the clock jumped back
