"""What an environment drives: a twin in process, or a rig over topics or pipes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

from pendulum_twin.arrays import Floats
from pendulum_twin.errors import RigError


@dataclass(frozen=True)
class Sample:
    """Hold one measurement.

    state: (4,) x (m), th (rad, 0 upright, not wrapped), v (m/s), w (rad/s).
    stamp_s: s; sampling time on the transport's own clock.
    info: what the transport reports of the exchange, copied into the environment's `info`: dt_s
        (s since the last sample), pwm_limit (the largest command that the rig takes, where that
        is known), and over topics delay_s, age_s, latency_s, overrun_s and counts.
    """

    state: Floats
    stamp_s: float
    info: Mapping[str, float] = field(default_factory=dict)


class NoAnswerError(RigError):
    """Say that rig or twin did not answer in time: what was awaited, and what to do."""


class Transport(Protocol):
    """Exchange commands for samples, a period apart.

    step_s: s; the period.

    `reset` and `exchange` raise NoAnswerError after their deadline; no call waits for ever.
    """

    step_s: float

    def reset(self) -> Sample:
        """Bring the pendulum to hang at rest in the middle; return the sample that shows it."""
        ...

    def exchange(self, command: float) -> Sample:
        """Hold a command (PWM fraction) for a period and return the sample at its end.

        It is the first sample that shows the whole period, never a sample from before the command.
        """
        ...

    def close(self) -> None:
        """Stop the drive and release everything; a second call does nothing."""
        ...
