"""The decisions of the live twin, without ROS."""

import pytest

from pendulum_twin.command_hold import CommandHold
from pendulum_twin.health import Level
from pendulum_twin.reset_answer import HANGS, format_answer, parse_stamp
from pendulum_twin.sample_clock import SampleClock
from pendulum_twin.twin_health import TwinFigures, TwinHealth

MS = 1_000_000


def test_a_command_holds_until_it_is_stale() -> None:
    hold = CommandHold(limit=0.5, timeout_s=0.2)
    assert hold.at(0) == 0.0
    assert hold.offer(0.3, 1000 * MS)
    assert [hold.at(t * MS) for t in (1000, 1200, 1201)] == [0.3, 0.3, 0.0]


@pytest.mark.parametrize(("sent", "held"), [(0.7, 0.5), (-3.0, -0.5), (0.2, 0.2)])
def test_a_command_is_clipped(sent: float, held: float) -> None:
    hold = CommandHold(0.5, 0.2)
    hold.offer(sent, 0)
    assert hold.at(0) == held


def test_what_is_no_number_is_refused_and_counted() -> None:
    hold = CommandHold(None, 0.2)
    hold.offer(4.0, 0)
    assert not hold.offer(float("nan"), 0) and not hold.offer(float("inf"), 0)
    assert hold.refused == 2 and hold.at(0) == 4.0
    hold.clear()
    assert hold.at(0) == 0.0 and hold.refused == 2


def test_a_limit_may_change_while_a_command_is_held() -> None:
    hold = CommandHold(0.5, 0.2)
    hold.offer(0.4, 0)
    hold.limit = 0.1
    assert hold.at(0) == 0.1
    hold.limit = None
    assert hold.at(0) == 0.4


def test_a_clock_set_back_makes_a_command_stale() -> None:
    hold = CommandHold(0.5, 0.2)
    hold.offer(0.4, 3600 * 1000 * MS)
    assert hold.at(0) == 0.0


def test_a_command_has_an_age() -> None:
    hold = CommandHold(0.5, 0.2)
    assert hold.age_s(0) is None
    hold.offer(0.4, 1000 * MS)
    assert hold.age_s(1500 * MS) == 0.5 and hold.taken == 1


def test_health_warns_of_what_is_new_since_the_last_report() -> None:
    health = TwinHealth()
    calm = health.of(TwinFigures("inteco", 100, 7, 0, 0, 0.25, 0.01))
    assert (calm.level, calm.sentence) == (Level.OK, "the twin inteco runs")
    assert (
        calm.figures["samples"] == 100
        and calm.figures["applied_pwm"] == 0.25
        and calm.figures["command_age_s"] == 0.01
    )
    bad = health.of(TwinFigures("inteco", 200, 7, 3, 12, 0.0, None))
    assert (bad.level, bad.sentence) == (
        Level.WARN,
        "3 commands refused and 12 samples lost since the last report",
    )
    assert bad.figures["command_age_s"] == "none"
    assert health.of(TwinFigures("inteco", 300, 7, 3, 12, 0.0, None)).level is Level.OK


def test_a_jittering_timer_gives_even_times() -> None:
    clock = SampleClock(0.01)
    asked = [0, 10.4, 19.8, 34.0, 34.1, 50.3]
    given = [t // MS for now in asked for t in clock.due(round(now * MS))]
    assert given == [0, 10, 20, 30, 40, 50]


def test_a_standstill_is_given_up_and_counted() -> None:
    clock = SampleClock(0.01)
    assert clock.due(0) == [0]
    assert clock.due(2000 * MS) == [2000 * MS]
    assert clock.lost == 199
    assert clock.due(2010 * MS) == [2010 * MS]


def test_a_clock_set_back_starts_anew() -> None:
    clock = SampleClock(0.01)
    clock.due(5000 * MS)
    assert clock.due(1000 * MS) == [1000 * MS]
    assert clock.due(1010 * MS) == [1010 * MS]


def test_no_drift_over_an_hour() -> None:
    clock = SampleClock(1 / 300)
    times = [t for k in range(3000) for t in clock.due(round(k * 1e9 / 300))]
    assert times[-1] == pytest.approx(2999 / 300 * 1e9, abs=1) and len(times) == 3000


@pytest.mark.parametrize("stamp_ns", [0, 5, 10**9, 12_340_000_000, 10**18 + 1])
def test_the_answer_to_a_reset_tells_the_stamp(stamp_ns: int) -> None:
    assert parse_stamp(format_answer(stamp_ns)) == stamp_ns and format_answer(stamp_ns).startswith(
        HANGS
    )


def test_the_answer_to_a_reset_in_real_time_tells_none() -> None:
    assert parse_stamp(format_answer(None)) is None
