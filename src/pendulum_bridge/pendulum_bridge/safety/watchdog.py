"""The ages of the last command and the last sample, and what follows when they are too old.

Ages are summed from one reading of the clock to the next, so that a clock that is set back makes
nothing young again: that step counts as 0. A jump forward (the process was suspended) makes
everything old.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from pendulum_bridge.safety.reasons import Reason
from pendulum_twin.errors import BadInputError


@dataclass(frozen=True)
class Timeouts:
    """Hold the largest ages.

    command_s: s, of a command.
    sample_s: s, of a sample.

    Raises BadInputError for a timeout that is NaN or not above 0.
    """

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
    """Hold the ages of the last command and the last sample.

    now_s: s, monotonic; the time of the ages.
    command_s: s; None before the first command.
    sample_s: s; None before the first sample.
    """

    now_s: float
    command_s: float | None = None
    sample_s: float | None = None


def compute_passed_s(ages: Ages, now_s: float) -> float:
    """Return the time since the last reading of the clock, s; 0 when the clock was set back."""
    return max(now_s - ages.now_s, 0.0)


def advance_ages(ages: Ages, now_s: float) -> Ages:
    """Return the ages at a later reading of the clock."""
    step = compute_passed_s(ages, now_s)
    return Ages(
        now_s, *(None if age is None else age + step for age in (ages.command_s, ages.sample_s))
    )


def note_command(ages: Ages, now_s: float | None = None) -> Ages:
    """Return the ages with a command that has just come.

    now_s: s, monotonic; when it came, if that is later than the last reading of the clock.
    """
    return replace(ages, command_s=0.0 if now_s is None else -compute_passed_s(ages, now_s))


def forget_command(ages: Ages) -> Ages:
    """Return the ages without a command."""
    return replace(ages, command_s=None)


def note_sample(ages: Ages, ago_s: float = 0.0) -> Ages:
    """Return the ages with a sample that came ago_s (s) before the last reading of the clock."""
    return replace(ages, sample_s=ago_s)


def find_silence(ages: Ages, timeouts: Timeouts) -> Reason | None:
    """Return why the rig counts as silent, or None while it sends."""
    if ages.sample_s is None:
        return Reason.NO_SAMPLE_YET
    return None if ages.sample_s <= timeouts.sample_s else Reason.RIG_SILENT


def find_missing_command(ages: Ages, timeouts: Timeouts) -> Reason | None:
    """Return why there is no command to apply, or None while there is a fresh one."""
    if ages.command_s is None:
        return Reason.NO_COMMAND_YET
    return None if ages.command_s <= timeouts.command_s else Reason.COMMAND_OLD
