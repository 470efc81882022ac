"""The part of a twin's command chain that acts at once, forwards and backwards.

A drive is what is left of the PWM fraction when it becomes force: force = drive times the twin's
force_per_pwm_n.
"""

from __future__ import annotations

from dataclasses import dataclass

from pendulum_twin.arrays import Floats
from pendulum_twin.effects import CATALOGUE
from pendulum_twin.effects.effect import Effect
from pendulum_twin.law_curves import bend_command_from_python, find_command
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import make_theta

NO_MEMORY: tuple[float, ...] = ()
NO_STEP_S = 0.0


@dataclass(frozen=True)
class StaticDrive:
    """Hold the static effects of a command chain.

    pwm_limit: PWM fraction; the largest command.
    bends: effects with their parameters, in the order in which they act.
    theta: (SIZE,) with the measured laws of the command, which act last; None for none.
    """

    pwm_limit: float
    bends: tuple[tuple[Effect, tuple[float, ...]], ...] = ()
    theta: Floats | None = None

    def compute_drive(self, pwm: float, t_s: float = 0.0) -> float:
        """Return the drive that a command gives at a time since the start."""
        u = self._clip(pwm)
        for effect, parameters in self.bends:
            u = effect.law(u, NO_MEMORY, NO_STEP_S, t_s, *parameters)
        return u if self.theta is None else float(bend_command_from_python(self.theta, u))

    def compute_pwm(self, drive: float, t_s: float = 0.0) -> float:
        """Return the command that gives a drive, or comes nearest to it."""
        u = drive if self.theta is None else float(find_command(self.theta, drive))
        for effect, parameters in reversed(self.bends):
            assert effect.inverse is not None  # `make_static_drive` takes no other
            u = effect.inverse(u, t_s, *parameters)
        return self._clip(u)

    @property
    def reach(self) -> float:
        """Return the largest drive that both directions give at the start."""
        return min(abs(self.compute_drive(sign * self.pwm_limit)) for sign in (-1.0, 1.0))

    def _clip(self, pwm: float) -> float:
        return min(max(pwm, -self.pwm_limit), self.pwm_limit)


def make_static_drive(twin: Twin, pwm_limit: float) -> StaticDrive:
    """Return the static part of a twin's command chain, for commands up to a limit."""
    return StaticDrive(
        min(pwm_limit, twin.rig.pwm_limit or pwm_limit),
        tuple(
            (effect, tuple(twin.effects[effect.name].values()) or (1.0,))  # 1: a switch that is on
            for effect in CATALOGUE
            if effect.name in twin.effects and effect.is_static and effect.inverse is not None
        ),
        make_theta(twin) if "command_curve" in twin.measured_laws else None,
    )
