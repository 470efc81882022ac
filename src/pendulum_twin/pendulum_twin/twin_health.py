"""Say in a sentence how a live twin is."""

from __future__ import annotations

from dataclasses import dataclass

from pendulum_twin.health import Health, Level


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
    """

    twin: str
    samples: int
    commands: int
    refused: int
    lost: int
    applied_pwm: float
    command_age_s: float | None


class TwinHealth:
    """Report how a live twin is, and remember what was reported already."""

    def __init__(self) -> None:
        self._refused = self._lost = 0

    def report(self, now: TwinFigures) -> Health:
        """Return a warning when commands were refused or samples lost since the last call."""
        refused, lost = now.refused - self._refused, now.lost - self._lost
        self._refused, self._lost = now.refused, now.lost
        losses = [
            f"{count} {what}"
            for count, what in ((refused, "commands refused"), (lost, "samples lost"))
            if count > 0
        ]
        sentence = f"the twin {now.twin} runs"
        if losses:
            sentence = f"{' and '.join(losses)} since the last report"
        figures: dict[str, float | int | str] = {
            "twin": now.twin,
            "samples": now.samples,
            "commands": now.commands,
            "refused_commands": now.refused,
            "lost_samples": now.lost,
            "applied_pwm": now.applied_pwm,
            "command_age_s": "none" if now.command_age_s is None else now.command_age_s,
        }
        return Health(Level.WARN if losses else Level.OK, sentence, figures)
