"""Hold the twin that runs now: the state of a live twin, whatever its pace."""

from __future__ import annotations

from pendulum_twin.arrays import Floats
from pendulum_twin.command_hold import CommandHold
from pendulum_twin.model import Twin
from pendulum_twin.stepper import Stepper, compile_for_any_effect


class LiveTwin:
    """Run a twin sample by sample, driven by the last command that was offered.

    All is compiled when it is made; later nothing is, whatever twin takes its place.

    twin: runs now.
    period_s: s from sample to sample.
    timeout_s: see `CommandHold`.
    commands: what was offered.
    applied: PWM fraction held over the last period.
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
        """Hold the command of now_ns over a period; return it, clipped, 0 when stale."""
        self.applied = self.commands.get_command(now_ns)
        self._stepper.step(self.applied)
        return self.applied

    def reset(self) -> None:
        """Hang at rest in the middle of the rail; nothing is left of earlier commands."""
        self.commands.clear()
        self.applied = 0.0
        self._stepper.reset()

    def become(self, twin: Twin) -> None:
        """Go on as another twin from the present measured state.

        The drive forgets earlier commands (its delay, its lag); the last command counts as held
        for long.
        """
        stepper = Stepper(twin, self._period_s, tuple(map(float, self.state)), self.applied)
        self.twin, self._stepper = twin, stepper
        self.commands.limit = twin.rig.pwm_limit
