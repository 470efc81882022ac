"""What a twin's command chain makes of a held command, once delays and lags are over; and the command for a wanted drive.

A drive is what is left of the PWM fraction when it becomes force: force = drive times the twin's
force_per_pwm_n.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from pendulum_twin.model import Twin


@dataclass(frozen=True)
class StaticDrive:
    """Hold the parts that act at once, in the order in which they act; the defaults do nothing.

    way: 1, or -1 where a positive command drives the negative way. dead: width of the dead zone.
    limit: where the command is clipped behind it. ratio: how much stronger positive commands are
    than the mean. per_s: change of the gain a second.
    pwm_limit: largest command.
    """

    pwm_limit: float
    way: float = 1.0
    dead: float = 0.0
    limit: float = math.inf
    ratio: float = 0.0
    per_s: float = 0.0

    def given(self, pwm: float, t_s: float = 0.0) -> float:
        """Return the drive that a command gives at a time."""
        u = self.way * min(max(pwm, -self.pwm_limit), self.pwm_limit)
        u = math.copysign(min(max(abs(u) - self.dead, 0.0), self.limit), u)
        return u * self._gain(u, t_s)

    def asked(self, drive: float, t_s: float = 0.0) -> float:
        """Return the command that gives a drive, or the nearest that can be had."""
        u = drive / self._gain(drive, t_s)
        if u == 0.0:
            return 0.0
        u = math.copysign(min(abs(u), self.limit) + self.dead, u)
        return self.way * min(max(u, -self.pwm_limit), self.pwm_limit)

    @property
    def reach(self) -> float:
        """Return the drive that can be had both ways at the start."""
        return min(abs(self.given(sign * self.pwm_limit)) for sign in (-1.0, 1.0))

    def _gain(self, drive: float, t_s: float) -> float:
        return (1.0 + math.copysign(self.ratio, self.ratio * drive)) * max(
            1.0 + self.per_s * t_s, 0.1
        )


def make_static_drive(twin: Twin, pwm_limit: float) -> StaticDrive:
    """Return the static part of a twin's command chain, for commands up to a limit."""
    effects = twin.effects
    return StaticDrive(
        pwm_limit=min(pwm_limit, twin.rig.pwm_limit or pwm_limit),
        way=-1.0 if "input_sign_inverted" in effects else 1.0,
        dead=effects.get("input_dead_zone", {}).get("width", 0.0),
        limit=effects.get("input_saturation", {}).get("limit", math.inf),
        ratio=effects.get("gain_asymmetry", {}).get("ratio", 0.0),
        per_s=effects.get("gain_drift", {}).get("per_s", 0.0),
    )
