"""What a pace needs of whatever carries commands to a rig, and brings its samples."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Received:
    """Hold a sample that has come: state x (m), th (rad), v (m/s), w (rad/s); sampling time; monotonic time of arrival."""

    state: NDArray[np.float64]
    stamp_ns: int
    arrived_s: float


class RigLink(Protocol):
    """Carry commands and samples, in order."""

    @property
    def name(self) -> str:
        """Return the rig's name, for sentences."""
        ...

    def send(self, command: float) -> None:
        """Send a command (PWM fraction) at once."""
        ...

    def wait(self, timeout_s: float) -> Received | None:
        """Return the oldest sample that was not taken yet; None when none has come within timeout_s, which may be 0."""
        ...

    def now_s(self) -> float:
        """Return the monotonic time of arrivals."""
        ...

    def now_ns(self) -> int:
        """Return the time on the clock of stamps; without meaning in lockstep."""
        ...
