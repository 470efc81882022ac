"""Commands: refused unless finite, clipped, and slowed down per second, not per message."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pendulum_bridge.safety.limits import (
    Limits,
    compute_left_s,
    compute_slewing_s,
    find_refusal,
    limit_command,
)
from pendulum_bridge.safety.reasons import Reason
from pendulum_twin.errors import BadInputError

FINITE = st.floats(allow_nan=False, allow_infinity=False)
WITHIN = st.floats(-0.5, 0.5)


@pytest.mark.parametrize("command", [math.nan, math.inf, -math.inf])
def test_what_is_no_number_is_refused(command: float) -> None:
    assert find_refusal(command) is Reason.COMMAND_NOT_FINITE


@pytest.mark.parametrize("command", [0.0, -0.5, 1e300, 1])
def test_every_number_is_taken(command: float) -> None:
    assert find_refusal(command) is None


@pytest.mark.parametrize(
    ("requested", "applied", "elapsed_s", "pwm", "reasons"),
    [
        (0.3, 0.3, 0.01, 0.3, ()),
        (0.3, 0.0, 0.01, 0.1, (Reason.TOO_FAST,)),
        (-0.3, 0.0, 0.01, -0.1, (Reason.TOO_FAST,)),
        (0.3, 0.0, 0.03, 0.3, ()),
        (2.0, 0.45, 0.01, 0.5, (Reason.OVER_LIMIT,)),
        (2.0, 0.0, 0.02, 0.2, (Reason.OVER_LIMIT, Reason.TOO_FAST)),
        (0.3, 0.1, 0.0, 0.1, (Reason.TOO_FAST,)),
        (0.3, 0.1, -5.0, 0.1, (Reason.TOO_FAST,)),  # the clock jumped back
    ],
)
def test_known_answers(
    requested: float, applied: float, elapsed_s: float, pwm: float, reasons: tuple
) -> None:
    limited = limit_command(requested, applied, elapsed_s, Limits(0.5, 10.0))
    assert limited.pwm == pytest.approx(pwm) and limited.reasons == reasons


def test_no_slew_limit_at_all() -> None:
    assert limit_command(0.5, -0.5, 0.0, Limits(0.5, math.inf)).pwm == 0.5
    assert limit_command(24.0, -24.0, 0.0, Limits(24.0, math.inf)).pwm == 24.0  # V
    assert limit_command(-0.1, 0.5, 0.0, Limits(0.1, math.inf)).pwm == -0.1  # set lower since


@given(FINITE, WITHIN, st.floats(-1, 10), st.floats(0.01, 1e3))
def test_never_over_the_limit_nor_faster(
    requested: float, applied: float, elapsed_s: float, slew: float
) -> None:
    limited = limit_command(requested, applied, elapsed_s, Limits(0.5, slew))
    assert abs(limited.pwm) <= 0.5
    assert abs(limited.pwm - applied) <= slew * max(elapsed_s, 0.0) + 1e-12
    assert (limited.pwm == requested) == (limited.reasons == ())


@given(WITHIN, WITHIN, st.integers(1, 50))
def test_a_flood_of_messages_moves_no_further_than_one(
    requested: float, applied: float, messages: int
) -> None:
    limits = Limits(0.5, 10.0)
    at_once = limit_command(requested, applied, 0.02, limits).pwm
    for _ in range(messages):
        applied = limit_command(requested, applied, 0.02 / messages, limits).pwm
    assert applied == pytest.approx(at_once)


@pytest.mark.parametrize(
    ("magnitude", "slew"),
    [(0.0, 1.0), (math.nan, 1.0), (math.inf, 1.0), (0.5, 0.0), (0.5, math.nan)],
)
def test_a_limit_that_is_none_is_refused(magnitude: float, slew: float) -> None:
    with pytest.raises(BadInputError, match="expected a number above 0, found"):
        Limits(magnitude, slew)


@given(st.lists(st.tuples(st.floats(0, 0.05), WITHIN), max_size=60), st.floats(0.1, 100.0))
def test_over_any_time_a_command_moves_no_further_than_that_time_and_a_period_allow(
    steps: list, slew: float
) -> None:
    period_s, limits = 0.01, Limits(0.5, slew)
    applied, unused_s, ahead_s = (
        0.0,
        0.0,
        0.0,
    )  # how far it is ahead of its slew limit, since when that is most
    for passed_s, requested in steps:
        may_s = compute_slewing_s(unused_s, passed_s, period_s)
        pwm = limit_command(requested, applied, may_s, limits).pwm
        unused_s = compute_left_s(may_s, pwm - applied, limits)
        ahead_s = max(ahead_s - passed_s, -passed_s) + abs(pwm - applied) / slew
        assert ahead_s <= period_s + 1e-9
        assert 0 <= unused_s <= max(period_s, passed_s) + 1e-12
        applied = pwm


def test_what_is_left_over_is_used_later_but_never_more_than_a_period_of_it() -> None:
    limits = Limits(0.5, 10.0)
    assert compute_left_s(0.01, 0.04, limits) == pytest.approx(0.006)
    assert compute_left_s(0.01, -0.2, limits) == 0.0  # the rail guard moved it further
    assert compute_slewing_s(0.006, 0.002, 0.01) == pytest.approx(0.008)
    assert compute_slewing_s(0.006, 0.007, 0.01) == 0.01
    assert compute_slewing_s(0.006, 0.5, 0.01) == 0.5
    assert compute_left_s(0.01, 1.0, Limits(0.5, math.inf)) == 0.01
