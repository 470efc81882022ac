"""Which command acts now: the last good one, clipped, while it is fresh."""

import pytest

from pendulum_twin.command_hold import CommandHold

MS = 1_000_000  # ns


def test_a_command_holds_until_it_is_stale() -> None:
    hold = CommandHold(limit=0.5, timeout_s=0.2)
    assert hold.get_command(0) == 0.0
    assert hold.offer(0.3, 1000 * MS)
    assert [hold.get_command(t * MS) for t in (1000, 1200, 1201)] == [0.3, 0.3, 0.0]


@pytest.mark.parametrize(("sent", "held"), [(0.7, 0.5), (-3.0, -0.5), (0.2, 0.2)])
def test_a_command_is_clipped(sent: float, held: float) -> None:
    hold = CommandHold(0.5, 0.2)
    hold.offer(sent, 0)
    assert hold.get_command(0) == held


def test_what_is_no_number_is_refused_and_counted() -> None:
    hold = CommandHold(None, 0.2)
    hold.offer(4.0, 0)
    assert not hold.offer(float("nan"), 0) and not hold.offer(float("inf"), 0)
    assert hold.refused == 2 and hold.get_command(0) == 4.0
    hold.clear()
    assert hold.get_command(0) == 0.0 and hold.refused == 2


def test_a_limit_may_change_while_a_command_is_held() -> None:
    hold = CommandHold(0.5, 0.2)
    hold.offer(0.4, 0)
    hold.limit = 0.1
    assert hold.get_command(0) == 0.1
    hold.limit = None
    assert hold.get_command(0) == 0.4


def test_a_clock_set_back_makes_a_command_stale() -> None:
    hold = CommandHold(0.5, 0.2)
    hold.offer(0.4, 3600 * 1000 * MS)
    assert hold.get_command(0) == 0.0


def test_a_command_has_an_age() -> None:
    hold = CommandHold(0.5, 0.2)
    assert hold.compute_age_s(0) is None
    hold.offer(0.4, 1000 * MS)
    assert hold.compute_age_s(1500 * MS) == 0.5 and hold.taken == 1
