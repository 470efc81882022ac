"""The twin that runs now: the one state that a live twin has, whatever its pace."""

from __future__ import annotations

from pendulum_twin.arrays import Floats
from pendulum_twin.command_hold import CommandHold
from pendulum_twin.model import Twin
from pendulum_twin.stepper import Stepper, compile_for_any_effect


class LiveTwin:
    """Run one twin sample by sample, driven by the last command that was offered.

    period_s: from sample to sample. timeout_s: see `CommandHold`. Afterwards nothing is compiled
    any more, whatever twin takes its place. commands: what was offered. applied: the PWM fraction
    held over the last period.
    """

    def __init__(self, twin: Twin, period_s: float, timeout_s: float) -> None:
        compile_for_any_effect(twin, period_s)
        self.twin = twin
        self.commands = CommandHold(twin.rig.pwm_limit, timeout_s)
        self.applied = 0.0
        self._period_s = period_s
        self._stepper = Stepper(twin, period_s)

    @property
    def state(self) -> Floats:
        """Return the measured state now, shape (4,): x (m), th (rad), v (m/s), w (rad/s)."""
        return self._stepper.state

    def advance(self, now_ns: int) -> float:
        """Hold the command that is due at now_ns over one period; return it, clipped, 0 when stale."""
        self.applied = self.commands.at(now_ns)
        self._stepper.step(self.applied)
        return self.applied

    def reset(self) -> None:
        """Hang at rest in the middle of the rail, with nothing left of earlier commands."""
        self.commands.clear()
        self.applied = 0.0
        self._stepper.reset()

    def become(self, twin: Twin) -> None:
        """Go on as another twin from the measured state of this one.

        What the drive still remembered of earlier commands (a delay, a lag) is gone; the last
        command stays as if long held.
        """
        stepper = Stepper(twin, self._period_s, tuple(map(float, self.state)), self.applied)
        self.twin, self._stepper = twin, stepper
        self.commands.limit = twin.rig.pwm_limit
