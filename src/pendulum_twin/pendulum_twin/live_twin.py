"""Hold the twin that runs now: the state of a live twin, whatever its pace.

The cart of a live twin stops at the ends of the rail (`rail_ends`).
"""

from __future__ import annotations

from pendulum_twin.arrays import Floats
from pendulum_twin.command_hold import CommandHold
from pendulum_twin.model import Twin
from pendulum_twin.rail_ends import Impact, find_end_m
from pendulum_twin.stepper import Stepper, compile_for_any_effect


class LiveTwin:
    """Run a twin sample by sample, driven by the last command that was offered.

    All is compiled when it is made; later nothing is, whatever twin takes its place.

    twin: runs now, without what belongs to a recording of the rig.
    period_s: s from sample to sample.
    timeout_s: see `CommandHold`.
    commands: what was offered.
    applied: PWM fraction held over the last period.
    impacts: how often the cart came against an end of the rail.
    last_impact: the hardest impact of the last contact; None before the first.
    """

    def __init__(self, twin: Twin, period_s: float, timeout_s: float) -> None:
        self.twin = twin.drop_recording_effects()
        compile_for_any_effect(self.twin, period_s)
        self.commands = CommandHold(twin.rig.pwm_limit, timeout_s)
        self.applied = 0.0
        self.impacts = 0
        self.last_impact: Impact | None = None
        self._period_s = period_s
        self._stepper = Stepper(self.twin, period_s, end_m=find_end_m(twin.rig))
        self._touching = False

    @property
    def state(self) -> Floats:
        """Return the measured state now, shape (4,): x (m), th (rad), v (m/s), w (rad/s)."""
        return self._stepper.state

    def advance(self, now_ns: int) -> float:
        """Hold the command of now_ns over a period; return it, clipped, 0 when stale."""
        self.applied = self.commands.get_command(now_ns)
        self._stepper.step(self.applied)
        self._note_impact(self._stepper.impact)
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
        lasting = twin.drop_recording_effects()
        stepper = Stepper(
            lasting,
            self._period_s,
            tuple(map(float, self.state)),
            self.applied,
            find_end_m(twin.rig),
        )
        self.twin, self._stepper = lasting, stepper
        self.commands.limit = twin.rig.pwm_limit

    def _note_impact(self, impact: Impact | None) -> None:
        """Count a contact once, however long the cart is pushed against the end."""
        if impact is not None:
            if not self._touching:
                self.impacts += 1
                self.last_impact = impact
            elif self.last_impact is None or impact.speed_m_s > self.last_impact.speed_m_s:
                self.last_impact = impact
        self._touching = impact is not None
