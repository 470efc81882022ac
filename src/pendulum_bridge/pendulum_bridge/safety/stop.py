"""The emergency stop: it latches, drops commands meanwhile, and is cleared only on purpose."""

from __future__ import annotations

from dataclasses import dataclass, replace

from pendulum_bridge.safety.reasons import Reason


@dataclass(frozen=True)
class Stop:
    """Hold the state of the stop.

    latched: whether it is pressed.
    zero_seen: whether the last command since it was pressed was 0.
    dropped: commands dropped by all stops so far.
    """

    latched: bool = False
    zero_seen: bool = False
    dropped: int = 0


def press_stop(stop: Stop) -> Stop:
    """Return the stop latched; pressing it again requires a command of 0 again."""
    return replace(stop, latched=True, zero_seen=False)


def drop_command(stop: Stop, command: float) -> Stop:
    """Return a latched stop after a command, which it drops; it notes only whether that was 0."""
    return replace(stop, zero_seen=command == 0, dropped=stop.dropped + 1)


def clear_stop(stop: Stop) -> tuple[Stop, Reason]:
    """Return the stop after a request to clear it, and the answer to the request.

    It stays latched unless the last command was 0: any other command would move the cart at once.
    """
    if not stop.latched:
        return stop, Reason.NOT_STOPPED
    if not stop.zero_seen:
        return stop, Reason.ZERO_FIRST
    return replace(stop, latched=False, zero_seen=False), Reason.STOP_CLEARED
