"""The driver's health: the worst since the last report, and whether the rate is right."""

import pytest

from pendulum_bridge.driver.health import Report, make_health, pick_worse
from pendulum_bridge.driver.latency import KEPT_DURATIONS, Latency
from pendulum_bridge.safety.reasons import Reason
from pendulum_twin.health import Level


def test_the_worse_reason_is_kept_and_the_later_of_equals() -> None:
    assert pick_worse(Reason.RIG_SILENT, None) is Reason.RIG_SILENT
    assert pick_worse(Reason.RIG_SILENT, Reason.RAIL_BRAKING) is Reason.RIG_SILENT
    assert pick_worse(Reason.RIG_SILENT, Reason.COMMAND_OLD) is Reason.COMMAND_OLD
    assert pick_worse(Reason.OVER_LIMIT, None) is None  # all is well again
    assert pick_worse(None, Reason.RAIL_BRAKING) is Reason.RAIL_BRAKING


@pytest.mark.parametrize(
    ("report", "level", "sentence"),
    [
        (Report(None, "", 100, 1.0), Level.OK, "Commands are sent as they come."),
        (Report(Reason.RIG_SILENT, "", 50, 1.0), Level.ERROR, Reason.RIG_SILENT.sentence),
        (Report(Reason.RIG_SILENT, "no route", 0, 1.0), Level.ERROR, "no route"),
        (
            Report(Reason.RIG_SILENT, "", 50, 1.0, standstill_s=0.31),
            Level.ERROR,
            "This computer stood still for 310 ms: it is busy. The rig has fallen silent",
        ),
        (
            Report(None, "", 50, 1.0, standstill_s=0.31),
            Level.WARN,
            "This computer stood still for 310 ms: it is busy.",
        ),
        (Report(None, "", 104, 1.0), Level.OK, "Commands are sent as they come."),
        (
            Report(None, "", 50, 1.0),
            Level.WARN,
            "The rig sends 50 samples a second, expected are 100: set rate_hz",
        ),
        (
            Report(None, "", 2000, 1.0, 1000.0),
            Level.WARN,
            "sends 2000 samples a second, expected are 1000",
        ),
    ],
)
def test_level_and_sentence(report: Report, level: Level, sentence: str) -> None:
    health = make_health(report, {"applied_pwm": 0.1})
    assert health.level is level and sentence in health.sentence
    assert health.figures == {"rate_hz": report.samples / 1.0, "applied_pwm": 0.1}


def test_latency_is_of_the_last_so_many() -> None:
    latency = Latency()
    assert latency.summarize("x") == {}
    for value in (*[9.0] * 50, *[k / 1000 for k in range(KEPT_DURATIONS)]):
        latency.add(value)
    latency.add(-1.0)  # the clock was set back
    assert latency.summarize("x") == {
        "x_p50_ms": pytest.approx(499),
        "x_p99_ms": pytest.approx(989),
    }
