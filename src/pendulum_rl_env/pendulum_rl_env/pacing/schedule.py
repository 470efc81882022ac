"""The ends of steps: every step_s from one moment on, so that errors do not add up."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass
class Schedule:
    """Hold the end of the present step.

    A step's deadline is its end: a command that comes later has missed it. The schedule then
    begins anew at the command, so that no caller has to catch up.

    step_s: s; length of a step.
    end_s: s; end of the present step on the monotonic clock.
    end_ns: ns; the same on the clock of stamps.
    missed: how many deadlines were missed.
    """

    step_s: float
    end_s: float = 0.0
    end_ns: int = 0
    missed: int = 0

    def start(self, now_s: float, stamp_ns: int) -> None:
        """Let the next step begin now, with a sample of this stamp."""
        self.end_s, self.end_ns = now_s, stamp_ns

    def advance(self, now_s: float, now_ns: int) -> float:
        """Go to the next step, whose command is sent now; return its delay, s, 0 when in time."""
        self.end_s += self.step_s
        self.end_ns += round(1e9 * self.step_s)
        if now_s <= self.end_s:
            return 0.0
        late_s = now_s - self.end_s
        self.missed += 1
        self.end_s, self.end_ns = now_s + self.step_s, now_ns + round(1e9 * self.step_s)
        return late_s
