"""What a pace needs from whatever carries commands to a rig and brings its samples."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from pendulum_twin.arrays import Floats


@dataclass(frozen=True)
class Received:
    """Hold a sample that has arrived.

    state: (4,) x (m), th (rad), v (m/s), w (rad/s).
    stamp_ns: ns; sampling time.
    arrived_s: s; monotonic time of arrival.
    """

    state: Floats
    stamp_ns: int
    arrived_s: float


class RigLink(Protocol):
    """Carry commands and samples, in order."""

    @property
    def name(self) -> str:
        """Return the rig's name, for messages."""
        ...

    def send(self, command: float) -> None:
        """Send a command (PWM fraction) at once."""
        ...

    def wait(self, timeout_s: float) -> Received | None:
        """Return the oldest sample not taken yet; None when none comes within timeout_s (s)."""
        ...

    def now_s(self) -> float:
        """Return the monotonic time of arrivals, s."""
        ...

    def now_ns(self) -> int:
        """Return the time on the clock of stamps, ns; without meaning in lockstep."""
        ...
