"""What happens between two decisions: commands, stop, reset, writers, and the driver's own state.

Each function returns the state after an event, and, where somebody waits for it, the answer.
"""

from __future__ import annotations

import math
from dataclasses import replace

from pendulum_bridge.safety import encoder_check, two_writers, watchdog
from pendulum_bridge.safety import reset as swing_down
from pendulum_bridge.safety.cart_direction import CartDirection
from pendulum_bridge.safety.command_waits import estimate_wait_s, remember_age
from pendulum_bridge.safety.limits import find_refusal
from pendulum_bridge.safety.reasons import Level, Reason
from pendulum_bridge.safety.reset import Reset
from pendulum_bridge.safety.state import Rules, Safety
from pendulum_twin import emergency_stop
from pendulum_twin.emergency_stop import StopAnswer

# without a decision for so long, the driver stood still: it decides every 30 ms
STANDSTILL_S = 0.15
# a command so soon after a standstill, or an activation, may have waited through it: its time of
# sending counts
UNSURE_S = 1.0

STOP_REASONS = {
    StopAnswer.STOPPED: Reason.STOPPED,
    StopAnswer.CLEARED: Reason.STOP_CLEARED,
    StopAnswer.NOT_STOPPED: Reason.NOT_STOPPED,
    StopAnswer.ZERO_FIRST: Reason.ZERO_FIRST,
}


def take_command(
    command: float,
    safety: Safety,
    now_s: float | None = None,
    ago_s: float = 0.0,
    longest_s: float = math.inf,
) -> tuple[Safety, Reason | None]:
    """Return the state after a command, and why it was refused; None when it was accepted.

    command: PWM fraction.
    now_s: s, monotonic; when the command came, if that is later than the last decision.
    ago_s: s; how long before its arrival the command was sent, perhaps by the clocks of two
        machines, see `command_waits`.
    longest_s: s; a command that waited for longer is refused.
    """
    now_s, counts = safety.ages.now_s if now_s is None else now_s, safety.counts
    waited_s = estimate_wait_s(ago_s, safety.command_ages_s)
    safety = replace(safety, command_ages_s=remember_age(ago_s, safety.command_ages_s))
    if safety.stop.latched:
        return replace(
            safety, stop=emergency_stop.drop_command(safety.stop, command)
        ), Reason.DROPPED
    if (refused := find_refusal(command)) is not None:
        return replace(safety, counts=replace(counts, commands=counts.commands + 1)), refused
    if not safety.active:
        return replace(
            safety, counts=replace(counts, while_inactive=counts.while_inactive + 1)
        ), Reason.INACTIVE
    if safety.reset is not None:
        return replace(
            safety, counts=replace(counts, during_reset=counts.during_reset + 1)
        ), Reason.RESETTING
    if two_writers.has_two_writers(safety.writers, now_s):
        counts = replace(counts, of_two_writers=counts.of_two_writers + 1)
        return forget_command(replace(safety, counts=counts)), Reason.TWO_WRITERS
    stands = watchdog.compute_passed_s(safety.ages, now_s) > STANDSTILL_S
    unsure = 0 <= now_s - safety.resumed_s < min(waited_s, UNSURE_S)
    if stands or unsure or waited_s > longest_s:
        return replace(
            safety, counts=replace(counts, after_standstill=counts.after_standstill + 1)
        ), Reason.STOOD_STILL
    return replace(safety, command=command, ages=watchdog.note_command(safety.ages, now_s)), None


def hear_writer(number: int, now_s: float, safety: Safety) -> Safety:
    """Return the state after a message with this number came from some writer of commands.

    number: the message's number, which its writer counts up.
    now_s: s, monotonic.
    """
    return replace(safety, writers=two_writers.hear_writer(number, now_s, safety.writers))


def note_last_word(safety: Safety, fault: Reason | None) -> Safety:
    """Return the state with why nobody could send PWM 0 for the driver; None: somebody could."""
    return safety if safety.last_word is fault else replace(safety, last_word=fault)


def press_stop(safety: Safety) -> tuple[Safety, Reason | None]:
    """Return the state with the emergency stop latched, and how that ended a reset.

    The second value is None when no reset was under way. The command is forgotten; the next
    decision,
    which should follow at once, sends 0.
    """
    ended = None if safety.reset is None else Reason.RESET_STOPPED
    return forget_command(
        replace(safety, stop=emergency_stop.press_stop(safety.stop), reset=None)
    ), ended


def activate(safety: Safety, now_s: float) -> Safety:
    """Return the state in which commands and resets are accepted, without a command yet.

    Commands that were sent before are dropped, though they come later (now_s: s, monotonic).
    The cart's direction is found anew: a person may have changed wires or twin file.
    """
    return forget_command(replace(safety, active=True, direction=CartDirection(), resumed_s=now_s))


def change_rules(safety: Safety, before: Rules, after: Rules) -> Safety:
    """Return the state under other rules: a direction that they give is not turned any more."""
    same = (before.guard.way, before.guard.pole_way) == (after.guard.way, after.guard.pole_way)
    return safety if same else replace(safety, direction=CartDirection())


def deactivate(safety: Safety) -> tuple[Safety, Reason | None]:
    """Return the state in which only 0 is sent, and how that ended a reset; None without a reset.

    The next decision, which should follow at once, sends 0.
    """
    ended = None if safety.reset is None else Reason.RESET_INACTIVE
    return forget_command(replace(safety, active=False, reset=None)), ended


def fail_safe(safety: Safety) -> tuple[Safety, Reason | None]:
    """Return the state after the driver itself failed, and how that ended a reset.

    The state has no command and no reset.
    """
    ended = None if safety.reset is None else Reason.RESET_FAILED
    return forget_command(replace(safety, reset=None, applied=0.0)), ended


def clear_stop(safety: Safety, rules: Rules) -> tuple[Safety, Reason]:
    """Return the state after a request to clear the stop, and the answer to the request."""
    stop, answer = emergency_stop.clear_stop(safety.stop, rules.timeouts.command_s)
    reason = STOP_REASONS[answer]
    safety = replace(safety, stop=stop)
    if reason is Reason.STOP_CLEARED:
        safety = replace(
            safety,
            encoders=encoder_check.trust_again(safety.encoders),
            direction=CartDirection(),
        )
    return safety, reason


def begin_reset(now_s: float, safety: Safety, rules: Rules) -> tuple[Safety, Reason]:
    """Return the state with a reset under way, or unchanged, and the answer to the request."""
    silence = watchdog.find_silence(watchdog.advance_ages(safety.ages, now_s), rules.timeouts)
    refused = swing_down.find_obstacle(silence, safety.stop.latched) or find_lasting_fault(safety)
    if refused is None and not safety.active:
        refused = Reason.RESET_INACTIVE
    if refused is not None:
        return safety, refused
    return forget_command(replace(safety, reset=safety.reset or Reset())), Reason.RESETTING


def find_lasting_fault(safety: Safety) -> Reason | None:
    """Return the encoder fault that lasts until a person has looked; a single spike is none."""
    fault = safety.encoders.fault
    return fault if fault and fault.level is Level.ERROR else None


def forget_command(safety: Safety) -> Safety:
    """Return the state without a command to apply."""
    return replace(safety, command=0.0, ages=watchdog.forget_command(safety.ages))
