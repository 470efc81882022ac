"""How old the last command and the last sample are, and what follows when they are too old.

Ages are summed up from one look at the clock to the next, so that a clock that jumps back makes
nothing young again: that step counts as 0, and time goes on from there. A jump forward (the
process was suspended) makes everything old.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from pendulum_bridge.safety.reasons import Reason
from pendulum_twin.errors import BadInputError


@dataclass(frozen=True)
class Timeouts:
    """Hold how old a command and a sample may be, s. Raises BadInputError for one that is NaN or not above 0."""

    command_s: float = 0.2
    sample_s: float = 0.2

    def __post_init__(self) -> None:
        for name, value in (("command timeout", self.command_s), ("rig timeout", self.sample_s)):
            if not 0 < value < math.inf:
                raise BadInputError(
                    f"{name}: expected a number of seconds above 0, found {value!r}"
                )


@dataclass(frozen=True)
class Ages:
    """Hold the ages of the last command and the last sample at now_s (monotonic, s); None for one that never came."""

    now_s: float
    command_s: float | None = None
    sample_s: float | None = None


def compute_passed_s(ages: Ages, now_s: float) -> float:
    """Return the time since the last look at the clock, s; 0 when the clock has jumped back."""
    return max(now_s - ages.now_s, 0.0)


def advance_ages(ages: Ages, now_s: float) -> Ages:
    """Return the ages at a later look at the clock."""
    step = compute_passed_s(ages, now_s)
    return Ages(
        now_s, *(None if age is None else age + step for age in (ages.command_s, ages.sample_s))
    )


def note_command(ages: Ages, now_s: float | None = None) -> Ages:
    """Return the ages with a command that came at this moment, or at now_s, later than the last look at the clock."""
    return replace(ages, command_s=0.0 if now_s is None else -compute_passed_s(ages, now_s))


def forget_command(ages: Ages) -> Ages:
    """Return the ages with no command to hold."""
    return replace(ages, command_s=None)


def note_sample(ages: Ages, ago_s: float = 0.0) -> Ages:
    """Return the ages with a sample that came at this moment, or so long ago."""
    return replace(ages, sample_s=ago_s)


def find_silence(ages: Ages, timeouts: Timeouts) -> Reason | None:
    """Return why the rig counts as silent, or None while it is heard."""
    if ages.sample_s is None:
        return Reason.NO_SAMPLE_YET
    return None if ages.sample_s <= timeouts.sample_s else Reason.RIG_SILENT


def find_missing_command(ages: Ages, timeouts: Timeouts) -> Reason | None:
    """Return why there is no command to apply, or None while there is one that is fresh."""
    if ages.command_s is None:
        return Reason.NO_COMMAND_YET
    return None if ages.command_s <= timeouts.command_s else Reason.COMMAND_OLD
