"""The emergency stop of rig and twin: it latches, drops commands, and is cleared only on purpose.

A stop may be cleared while nobody sends commands, or when the last command was 0: any other
command would move the cart at once.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum


class StopAnswer(Enum):
    """Answer a request to press or clear the stop, in a sentence for a person."""

    STOPPED = "The emergency stop is latched: PWM is 0 until it is cleared."
    CLEARED = "The emergency stop is cleared: PWM is 0 until the next command."
    NOT_STOPPED = "There is no emergency stop to clear."
    ZERO_FIRST = (
        "The emergency stop stays latched: commands other than 0 still come. End their sender, "
        "or let it send 0, then clear the stop again."
    )


@dataclass(frozen=True)
class Stop:
    """Hold the state of the stop.

    latched: whether it is pressed.
    zero_seen: whether the last command since it was pressed was 0.
    quiet_s: s; time since it was pressed or a command was dropped, whichever is later.
    dropped: commands dropped by all stops so far.
    """

    latched: bool = False
    zero_seen: bool = False
    quiet_s: float = 0.0
    dropped: int = 0


def press_stop(stop: Stop) -> Stop:
    """Return the stop latched; pressing it again begins the wait for 0 or silence again."""
    return replace(stop, latched=True, zero_seen=False, quiet_s=0.0)


def drop_command(stop: Stop, command: float) -> Stop:
    """Return a latched stop after a command, which it drops; it notes only whether that was 0."""
    return replace(stop, zero_seen=command == 0, quiet_s=0.0, dropped=stop.dropped + 1)


def let_time_pass(stop: Stop, passed_s: float) -> Stop:
    """Return the stop passed_s (s) later; a clock that was set back counts as standing."""
    return replace(stop, quiet_s=stop.quiet_s + max(passed_s, 0.0)) if stop.latched else stop


def clear_stop(stop: Stop, silence_s: float) -> tuple[Stop, StopAnswer]:
    """Return the stop after a request to clear it, and the answer to the request.

    silence_s: s; after so long without a command silence counts as a command of 0.
    """
    if not stop.latched:
        return stop, StopAnswer.NOT_STOPPED
    if not stop.zero_seen and stop.quiet_s <= silence_s:
        return stop, StopAnswer.ZERO_FIRST
    return replace(stop, latched=False, zero_seen=False, quiet_s=0.0), StopAnswer.CLEARED
