"""Say in a sentence how a live twin is."""

from __future__ import annotations

from dataclasses import dataclass

from pendulum_twin.emergency_stop import StopAnswer
from pendulum_twin.health import Health, Level
from pendulum_twin.rail_ends import Impact


@dataclass(frozen=True)
class TwinFigures:
    """Hold what a live twin counted since it started.

    twin: its name.
    samples: published.
    commands: taken, finite numbers.
    refused: commands that were no finite numbers.
    lost: samples that a standing machine has cost.
    applied_pwm: PWM fraction held over the last period.
    command_age_s: s since the last command; None when there was none.
    impacts: how often the cart came against an end of the rail.
    last_impact: the last of these; None when there was none.
    stopped: whether the emergency stop is latched.
    trouble: what keeps the twin from running, in a sentence; empty for nothing.
    """

    twin: str
    samples: int
    commands: int
    refused: int
    lost: int
    applied_pwm: float
    command_age_s: float | None
    impacts: int = 0
    last_impact: Impact | None = None
    stopped: bool = False
    trouble: str = ""


class TwinHealth:
    """Report how a live twin is, and remember what was reported already."""

    def __init__(self) -> None:
        self._refused = self._lost = self._impacts = 0

    def report(self, now: TwinFigures) -> Health:
        """Return the health since the last call.

        An error when the twin cannot run; a warning when the cart hit an end of the rail, commands
        were refused or samples lost, or the emergency stop is latched.
        """
        refused, lost = now.refused - self._refused, now.lost - self._lost
        impacts = now.impacts - self._impacts
        self._refused, self._lost, self._impacts = now.refused, now.lost, now.impacts
        losses = [
            f"{count} {what}"
            for count, what in ((refused, "commands refused"), (lost, "samples lost"))
            if count > 0
        ]
        level, sentence = Level.OK, f"the twin {now.twin} runs"
        if now.trouble:
            level, sentence = Level.ERROR, now.trouble
        elif impacts > 0 and now.last_impact is not None:
            level, sentence = Level.WARN, describe_impact(now.last_impact)
        elif losses:
            level, sentence = Level.WARN, f"{' and '.join(losses)} since the last report"
        elif now.stopped:
            level, sentence = Level.WARN, StopAnswer.STOPPED.value
        figures: dict[str, float | int | str] = {
            "twin": now.twin,
            "samples": now.samples,
            "commands": now.commands,
            "refused_commands": now.refused,
            "lost_samples": now.lost,
            "applied_pwm": now.applied_pwm,
            "command_age_s": "none" if now.command_age_s is None else now.command_age_s,
            "rail_end_impacts": now.impacts,
            "stopped": int(now.stopped),
        }
        return Health(level, sentence, figures)


def describe_impact(impact: Impact) -> str:
    """Return that the cart has hit an end of the rail, in a sentence."""
    return (
        f"the cart has hit the end of the rail at {impact.end_m:+.3g} m "
        f"with {impact.speed_m_s:.2g} m/s and was stopped there"
    )
