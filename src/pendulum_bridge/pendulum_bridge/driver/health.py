"""The driver's health: a level, a sentence, and the figures behind it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from pendulum_bridge.safety.reasons import Reason
from pendulum_twin.health import Health, Level
from pendulum_twin.standstill import describe_standstill

# rail guard, slew limit and sampling times rely on the rate that was set
RATE_TOLERANCE = 0.05


@dataclass(frozen=True)
class Report:
    """Hold what happened since the last report.

    worst: the worst reason; None when commands were sent as they came.
    fault: a failure beyond the decisions; empty for none.
    samples: number of samples.
    seconds: s, since the last report.
    expected_hz: Hz; the rate that was set.
    standstill_s: s; the longest time for which this process was not run; 0 for none worth naming.
    """

    worst: Reason | None = None
    fault: str = ""
    samples: int = 0
    seconds: float = 0.0
    expected_hz: float = 100.0
    standstill_s: float = 0.0

    @property
    def rate_hz(self) -> float:
        """Samples a second, Hz."""
        return self.samples / self.seconds if self.seconds > 0 else 0.0


def pick_worse(earlier: Reason | None, later: Reason | None) -> Reason | None:
    """Return the worse of two reasons, the later one for equal levels; None counts as OK."""
    return later if _get_level(later) >= _get_level(earlier) else earlier


def make_health(report: Report, figures: Mapping[str, float | int | str]) -> Health:
    """Return the driver's health with its figures."""
    level, sentence = _judge_report(report)
    return Health(level, sentence, {"rate_hz": report.rate_hz, **figures})


def _judge_report(report: Report) -> tuple[Level, str]:
    if report.fault:
        return Level.ERROR, report.fault
    level = _get_level(report.worst)
    if report.standstill_s:
        stood = describe_standstill(report.standstill_s)
        after = "" if report.worst is None else f" {report.worst.sentence}"
        return max(level, Level.WARN), f"{stood[0].upper()}{stood[1:]}: it is busy.{after}"
    if level is Level.OK and _is_rate_off(report):
        return Level.WARN, (
            f"The rig sends {report.rate_hz:.4g} samples a second, expected are "
            f"{report.expected_hz:g}: "
            "set rate_hz to what it sends."
        )
    return (
        level,
        "Commands are sent as they come." if report.worst is None else report.worst.sentence,
    )


def _is_rate_off(report: Report) -> bool:
    return report.samples > 0 and abs(report.rate_hz / report.expected_hz - 1) > RATE_TOLERANCE


def _get_level(reason: Reason | None) -> Level:
    return Level.OK if reason is None else reason.level
