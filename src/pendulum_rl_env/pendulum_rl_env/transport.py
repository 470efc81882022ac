"""What an environment drives: a twin in process, or a rig over topics or a wire. A command in, a sample out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from pendulum_twin.errors import BadInputError


@dataclass(frozen=True)
class Sample:
    """Hold what was measured, and when.

    state: x (m), th (rad, 0 upright, not wrapped), v (m/s), w (rad/s), shape (4,). stamp_s:
    sampling time, on the transport's own clock. info: what the transport knows of this exchange,
    put into the environment's `info` as it is: dt_s (since the last sample), and over topics
    age_s, latency_s, overrun_s and counts.
    """

    state: NDArray[np.float64]
    stamp_s: float
    info: Mapping[str, float] = field(default_factory=dict)


class NoAnswerError(BadInputError):
    """The rig or the twin did not answer in time; the sentence says what was waited for, and what to do."""


class Transport(Protocol):
    """Exchange commands for samples, a period apart.

    `step_s`: the period, s. `exchange` holds a command (PWM fraction) for it and returns the first
    sample that shows all
    of it: never one from before the command. `reset` returns when the pendulum hangs at rest in
    the middle of the rail, with the sample that shows it. Both raise `NoAnswerError` after their
    deadline; nothing waits for ever.
    """

    step_s: float

    def reset(self) -> Sample:
        """Bring the pendulum to hang at rest in the middle; return the sample that shows it."""
        ...

    def exchange(self, command: float) -> Sample:
        """Hold a command for a period and return the sample at its end."""
        ...

    def close(self) -> None:
        """Stop the drive and let go of what is held; a second time does nothing."""
        ...
