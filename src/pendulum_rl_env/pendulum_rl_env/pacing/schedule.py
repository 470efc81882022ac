"""When steps end: every step_s, counted from one moment, so that nothing adds up."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass
class Schedule:
    """Hold when the present step ends, on the monotonic clock (s) and on that of stamps (ns), and how many were missed.

    A step's deadline is its end: a command that comes later has missed it. The schedule is then
    set anew from the command, so that nobody has to catch up.
    """

    step_s: float
    end_s: float = 0.0
    end_ns: int = 0
    missed: int = 0

    def start(self, now_s: float, stamp_ns: int) -> None:
        """Let the next step begin now, with a sample of this stamp."""
        self.end_s, self.end_ns = now_s, stamp_ns

    def go_on(self, now_s: float, now_ns: int) -> float:
        """Go on to the next step, whose command is sent now; return by how much that was too late, 0 when in time."""
        self.end_s += self.step_s
        self.end_ns += round(1e9 * self.step_s)
        if now_s <= self.end_s:
            return 0.0
        late_s = now_s - self.end_s
        self.missed += 1
        self.end_s, self.end_ns = now_s + self.step_s, now_ns + round(1e9 * self.step_s)
        return late_s
