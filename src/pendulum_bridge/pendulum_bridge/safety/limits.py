"""Which commands are numbers, how large they may be, and how fast they may change in a second."""

from __future__ import annotations

import math
from dataclasses import dataclass

from pendulum_bridge.safety.reasons import Reason
from pendulum_twin.errors import BadInputError


@dataclass(frozen=True)
class Limits:
    """Hold the limits of a command.

    magnitude: largest PWM fraction either way. slew_per_s: largest change of it in a second;
    infinite for none. Raises BadInputError for a limit that is NaN or not above 0.
    """

    magnitude: float = 0.5
    slew_per_s: float = 50.0

    def __post_init__(self) -> None:
        if not 0 < self.magnitude < math.inf:
            raise BadInputError(f"pwm limit: expected a number above 0, found {self.magnitude!r}")
        if not self.slew_per_s > 0:
            raise BadInputError(
                f"slew limit (PWM a second): expected a number above 0, found {self.slew_per_s!r}"
            )


@dataclass(frozen=True)
class Limited:
    """Hold what may be applied (PWM fraction), and why it differs from what was asked; no reasons when it does not."""

    pwm: float
    reasons: tuple[Reason, ...] = ()


def find_refusal(command: float) -> Reason | None:
    """Return why a command is refused, or None for a good one."""
    return None if math.isfinite(command) else Reason.COMMAND_NOT_FINITE


def limit_command(asked: float, applied: float, elapsed_s: float, limits: Limits) -> Limited:
    """Return what may be applied now of a finite command, given what has been applied for the last elapsed_s.

    The slew limit is one of time: many messages in a short while move no further than one. A
    negative elapsed_s (the clock jumped back) counts as 0.
    """
    clipped = min(max(asked, -limits.magnitude), limits.magnitude)
    reach = _compute_reach(elapsed_s, limits)
    pwm = min(max(clipped, applied - reach), applied + reach)
    found = ((clipped != asked, Reason.OVER_LIMIT), (pwm != clipped, Reason.TOO_FAST))
    # once more for what was applied under a larger limit
    return Limited(
        min(max(pwm, -limits.magnitude), limits.magnitude),
        tuple(reason for on, reason in found if on),
    )


def compute_slewing_s(unused_s: float, passed_s: float, period_s: float) -> float:
    """Return for how long a command may be moving by now: the time passed, and what an earlier decision left unused.

    What is left over is never more than a sample period. So an answer that comes just after the
    decision at its sample may move as far as one at the sample itself, and over any time the
    command moves no further than that time and one period allow.
    """
    return min(unused_s + passed_s, max(period_s, passed_s))


def compute_left_s(may_s: float, moved: float, limits: Limits) -> float:
    """Return what is left unused of the time for which a command could move, after it has moved so far (PWM fraction)."""
    return max(may_s - abs(moved) / limits.slew_per_s, 0.0)


def _compute_reach(elapsed_s: float, limits: Limits) -> float:
    """Return how far a command may move from the one applied."""
    if limits.slew_per_s == math.inf:
        return 2 * limits.magnitude
    return limits.slew_per_s * max(elapsed_s, 0.0)
