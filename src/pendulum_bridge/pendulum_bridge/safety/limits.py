"""The limits of a command: finite, of limited size, and of limited change a second."""

from __future__ import annotations

import math
from dataclasses import dataclass

from pendulum_bridge.safety.reasons import Reason
from pendulum_twin.errors import BadInputError
from pendulum_twin.rig import LARGEST_PWM, Rig


@dataclass(frozen=True)
class Limits:
    """Hold the limits of a command.

    magnitude: PWM fraction, largest either way.
    slew_per_s: PWM fraction a second, largest change; infinite for none.

    Raises BadInputError for a limit that is NaN or not above 0.
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
    """Hold what may be applied, and why that differs from the request.

    pwm: PWM fraction.
    reasons: empty when the request is applied as it is.
    """

    pwm: float
    reasons: tuple[Reason, ...] = ()


def check_command_unit(rig: Rig) -> None:
    """Raise BadInputError when the rig's commands are no PWM fractions, as the wire has them."""
    if rig.pwm_limit is not None and rig.pwm_limit > LARGEST_PWM:
        raise BadInputError(
            f"the twin file's pwm_limit: expected at most {LARGEST_PWM:g}, a PWM fraction, as the "
            f"rig takes it, found {rig.pwm_limit:g} (volts, say): write force_per_pwm_n for a PWM "
            "of 1 and the limit as a fraction of it, or use a driver for such commands"
        )


def find_refusal(command: float) -> Reason | None:
    """Return why a command is refused, or None for a finite command."""
    return None if math.isfinite(command) else Reason.COMMAND_NOT_FINITE


def limit_command(request: float, applied: float, elapsed_s: float, limits: Limits) -> Limited:
    """Return what may be applied of a finite command.

    The slew limit is a limit a second: many messages in a short time move no further than one
    message.

    request: PWM fraction.
    applied: PWM fraction, what has been applied so far.
    elapsed_s: s; time for the change. A negative time (the clock was set back) counts as 0.
    """
    clipped = min(max(request, -limits.magnitude), limits.magnitude)
    reach = _compute_reach(elapsed_s, limits)
    pwm = min(max(clipped, applied - reach), applied + reach)
    checks = ((clipped != request, Reason.OVER_LIMIT), (pwm != clipped, Reason.TOO_FAST))
    # clipped again, as the command before may have been applied under a larger limit
    return Limited(
        min(max(pwm, -limits.magnitude), limits.magnitude),
        tuple(reason for applies, reason in checks if applies),
    )


def compute_slewing_s(unused_s: float, passed_s: float, period_s: float) -> float:
    """Return the time for which a command may change by now: the time passed and the time unused.

    The unused time never exceeds a sample period. So a command just after the decision at its
    sample
    may move as far as a command at the sample itself, and over any time the command moves no
    further
    than that time and a period allow.
    """
    return min(unused_s + passed_s, max(period_s, passed_s))


def compute_left_s(may_s: float, moved: float, limits: Limits) -> float:
    """Return the unused time for changes (s) after the command has moved.

    may_s: s; the time before.
    moved: PWM fraction; the change of the command.
    """
    return max(may_s - abs(moved) / limits.slew_per_s, 0.0)


def _compute_reach(elapsed_s: float, limits: Limits) -> float:
    """Return how far a command may move from the applied command."""
    if limits.slew_per_s == math.inf:
        return math.inf
    return limits.slew_per_s * max(elapsed_s, 0.0)
