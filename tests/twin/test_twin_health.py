"""What a live twin says of itself."""

from pendulum_twin.health import Level
from pendulum_twin.twin_health import TwinFigures, TwinHealth


def test_health_warns_of_what_is_new_since_the_last_report() -> None:
    health = TwinHealth()
    calm = health.report(TwinFigures("inteco", 100, 7, 0, 0, 0.25, 0.01))
    assert (calm.level, calm.sentence) == (Level.OK, "the twin inteco runs")
    assert (
        calm.figures["samples"] == 100
        and calm.figures["applied_pwm"] == 0.25
        and calm.figures["command_age_s"] == 0.01
    )
    bad = health.report(TwinFigures("inteco", 200, 7, 3, 12, 0.0, None))
    assert (bad.level, bad.sentence) == (
        Level.WARN,
        "3 commands refused and 12 samples lost since the last report",
    )
    assert bad.figures["command_age_s"] == "none"
    assert health.report(TwinFigures("inteco", 300, 7, 3, 12, 0.0, None)).level is Level.OK
