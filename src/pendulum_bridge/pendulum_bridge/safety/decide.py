"""What is sent to the rig, and why: stop, watchdog, encoder check, rail guard and limits together.

The stop overrides the watchdog, the watchdog the encoder check, the check the rail guard, and the
guard the limits. Nothing here reads a clock, a socket or a topic: the caller passes in what came
and when, and keeps the state.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from pendulum_bridge.safety import encoder_check, two_writers, watchdog
from pendulum_bridge.safety import reset as swing_down
from pendulum_bridge.safety.encoder_check import EncoderCheck, Encoders
from pendulum_bridge.safety.limits import (
    Limits,
    compute_left_s,
    compute_slewing_s,
    find_refusal,
    limit_command,
)
from pendulum_bridge.safety.rail_guard import RailGuard, Seen, guard_command, make_rail_guard
from pendulum_bridge.safety.reasons import Level, Reason, find_worst_level
from pendulum_bridge.safety.reset import Reset, SwingDown, make_swing_down
from pendulum_bridge.safety.rig_state import RigState
from pendulum_bridge.safety.two_writers import Writers
from pendulum_bridge.safety.watchdog import Ages, Timeouts
from pendulum_twin import emergency_stop
from pendulum_twin.emergency_stop import Stop, StopAnswer
from pendulum_twin.rig import Rig

# without a decision for so long, the driver stood still: it decides every 30 ms
STANDSTILL_S = 0.15
# a command so soon after a standstill may have waited through it: its time of sending counts
UNSURE_S = 1.0


STOP_REASONS = {
    StopAnswer.STOPPED: Reason.STOPPED,
    StopAnswer.CLEARED: Reason.STOP_CLEARED,
    StopAnswer.NOT_STOPPED: Reason.NOT_STOPPED,
    StopAnswer.ZERO_FIRST: Reason.ZERO_FIRST,
}


@dataclass(frozen=True)
class Rules:
    """Hold the constants of the decisions.

    limits: of a command.
    timeouts: after which a command or the samples count as missing.
    guard: of the rail.
    swing: the reset.
    encoders: the plausibility check of the encoders.
    period_s: s, from sample to sample.
    """

    limits: Limits
    timeouts: Timeouts
    guard: RailGuard
    swing: SwingDown
    encoders: EncoderCheck
    period_s: float


@dataclass(frozen=True)
class Counts:
    """Count what was refused since the start.

    commands: commands that were not finite.
    samples: samples that were not finite.
    during_reset: commands during a reset.
    of_two_writers: commands while two writers sent at once.
    after_standstill: commands that may have waited while the driver stood still.
    while_inactive: commands while the driver was not active.
    """

    commands: int = 0
    samples: int = 0
    during_reset: int = 0
    of_two_writers: int = 0
    after_standstill: int = 0
    while_inactive: int = 0


@dataclass(frozen=True)
class Safety:
    """Hold the state between two decisions.

    ages: of the last command and the last sample.
    stop: the emergency stop.
    reset: the reset under way; None while there is none.
    command: PWM fraction; the last good command, which counts only while its age allows it.
    rig: the last good sample; None before the first.
    encoders: whether samples can be believed.
    applied: PWM fraction; what was sent last.
    unused_s: s; time left over for slewing, see `limits.compute_left_s`.
    in_vain_s: s; how long the rail guard has pushed without effect.
    writers: who has sent commands lately.
    resumed_s: s, monotonic; when the last standstill of the driver ended.
    last_word: whether somebody sends PWM 0 when the driver no longer can.
    counts: what was refused.
    active: whether commands and resets are accepted.
    """

    ages: Ages
    stop: Stop = Stop()  # noqa: RUF009 (frozen)
    reset: Reset | None = None
    command: float = 0.0
    rig: RigState | None = None
    encoders: Encoders = Encoders()  # noqa: RUF009 (frozen)
    applied: float = 0.0
    unused_s: float = 0.0
    in_vain_s: float = 0.0
    writers: Writers = Writers()  # noqa: RUF009 (frozen)
    resumed_s: float = -math.inf
    last_word: bool = True
    counts: Counts = Counts()
    active: bool = True


@dataclass(frozen=True)
class FreshSample:
    """Hold a sample since the last decision.

    sample: the sample.
    ago_s: s; how long ago it came.
    gap_s: s; how long after the sample before it came, at most.
    """

    sample: RigState
    ago_s: float
    gap_s: float


@dataclass(frozen=True)
class Decision:
    """Hold what to send, the state for the next decision, and the reasons.

    pwm: PWM fraction to send.
    safety: the state for the next decision.
    reasons: the deciding reason first.
    reset_ended: how a reset ended in this decision; None when none did.
    """

    pwm: float
    safety: Safety
    reasons: tuple[Reason, ...]
    reset_ended: Reason | None = None

    @property
    def level(self) -> Level:
        """The worst level of the reasons: ERROR when the watchdog has acted."""
        return find_worst_level(self.reasons)


def make_rules(
    rig: Rig,
    limits: Limits = Limits(),  # noqa: B008 (frozen)
    timeouts: Timeouts = Timeouts(),  # noqa: B008 (frozen)
    way: int = 1,
    pole_way: int = 1,
    period_s: float = 0.01,
    reset_deadline_s: float = 20.0,
) -> Rules:
    """Return the rules for a rig; the rig's own PWM limit applies where it is lower.

    rig: constants of the rig.
    limits, timeouts: see `Limits` and `Timeouts`.
    way, pole_way: the rig's signs, see `RailGuard`.
    period_s: s, from sample to sample.
    reset_deadline_s: s, after which a reset is given up.

    Raises BadInputError when the rig lacks constants that the rules need.
    """
    limit = min(limits.magnitude, rig.pwm_limit or limits.magnitude)
    guard = make_rail_guard(rig, limit, way=way, pole_way=pole_way)
    swing_plan = make_swing_down(rig, limit, way, pole_way, reset_deadline_s)
    check = encoder_check.make_encoder_check(rig, limit, period_s)
    return Rules(replace(limits, magnitude=limit), timeouts, guard, swing_plan, check, period_s)


def make_safety(now_s: float) -> Safety:
    """Return the state at the start (now_s: s, monotonic): nothing was heard or sent yet."""
    return Safety(Ages(now_s))


def decide(
    request: float | None,
    sample: RigState | None,
    now_s: float,
    safety: Safety,
    rules: Rules,
    ago_s: float = 0.0,
    skipped: int = 0,
) -> Decision:
    """Return what to send now: stop > watchdog > encoder check > rail guard > limits.

    request: PWM fraction; the command since the last decision, None for none. Of several commands,
        pass all but the last to `take_command`.
    sample: the rig's sample since the last decision, None for none.
    now_s: s, monotonic.
    safety: the state after the last decision.
    rules: the constants.
    ago_s: s; how long ago the sample came.
    skipped: number of older samples since the last decision on a sample. A rig that catches up
        sends them at once, and each was a period of its time.
    """
    passed_s = watchdog.compute_passed_s(safety.ages, now_s)
    fresh = (
        None
        if sample is None
        else FreshSample(
            sample,
            ago_s,
            _compute_gap_s(safety, passed_s - ago_s, rules) + skipped * rules.period_s,
        )
    )
    if passed_s > STANDSTILL_S:
        safety = replace(safety, resumed_s=now_s)
    safety = replace(safety, stop=emergency_stop.let_time_pass(safety.stop, passed_s))
    safety, refused = _take_inputs(request, fresh, now_s, safety, rules)
    safety, ended = _advance_reset(fresh, passed_s, safety, rules)
    slewing_s = compute_slewing_s(safety.unused_s, passed_s, rules.period_s)
    if (reason := _find_reason_for_zero(safety, rules)) or safety.rig is None:
        safety = replace(safety, applied=0.0, unused_s=slewing_s)
        return Decision(0.0, safety, _list_reasons(reason, ended, *refused), ended)
    wanted = safety.reset.pwm if safety.reset else safety.command
    within = limit_command(wanted, safety.applied, slewing_s, rules.limits)
    seen = Seen(safety.rig, safety.ages.sample_s or 0.0, safety.applied)
    guarded = guard_command(within.pwm, seen, safety.in_vain_s, passed_s, rules.guard)
    unused = compute_left_s(slewing_s, guarded.pwm - safety.applied, rules.limits)
    safety = replace(safety, applied=guarded.pwm, unused_s=unused, in_vain_s=guarded.in_vain_s)
    mode = Reason.RESETTING if safety.reset else None
    return Decision(
        guarded.pwm, safety, _list_reasons(guarded.reason, mode, *within.reasons, *refused)
    )


def take_command(
    command: float, safety: Safety, now_s: float | None = None, ago_s: float = 0.0
) -> tuple[Safety, Reason | None]:
    """Return the state after a command, and why it was refused; None when it was accepted.

    command: PWM fraction.
    now_s: s, monotonic; when the command came, if that is later than the last decision.
    ago_s: s; how long before its arrival the command was sent, perhaps by the clocks of two
        machines. It matters only after the driver has stood still.
    """
    now_s, counts = safety.ages.now_s if now_s is None else now_s, safety.counts
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
        return _forget_command(replace(safety, counts=counts)), Reason.TWO_WRITERS
    if watchdog.compute_passed_s(
        safety.ages, now_s
    ) > STANDSTILL_S or 0 <= now_s - safety.resumed_s < min(ago_s, UNSURE_S):
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


def note_last_word(safety: Safety, runs: bool) -> Safety:
    """Return the state with whether somebody sends PWM 0 when the driver no longer can."""
    return safety if safety.last_word == runs else replace(safety, last_word=runs)


def press_stop(safety: Safety) -> tuple[Safety, Reason | None]:
    """Return the state with the emergency stop latched, and how that ended a reset.

    The second value is None when no reset was under way. The command is forgotten; the next
    decision,
    which should follow at once, sends 0.
    """
    ended = None if safety.reset is None else Reason.RESET_STOPPED
    return _forget_command(
        replace(safety, stop=emergency_stop.press_stop(safety.stop), reset=None)
    ), ended


def activate(safety: Safety) -> Safety:
    """Return the state in which commands and resets are accepted, without a command yet."""
    return _forget_command(replace(safety, active=True))


def deactivate(safety: Safety) -> tuple[Safety, Reason | None]:
    """Return the state in which only 0 is sent, and how that ended a reset; None without a reset.

    The next decision, which should follow at once, sends 0.
    """
    ended = None if safety.reset is None else Reason.RESET_INACTIVE
    return _forget_command(replace(safety, active=False, reset=None)), ended


def fail_safe(safety: Safety) -> tuple[Safety, Reason | None]:
    """Return the state after the driver itself failed, and how that ended a reset.

    The state has no command and no reset.
    """
    ended = None if safety.reset is None else Reason.RESET_FAILED
    return _forget_command(replace(safety, reset=None, applied=0.0)), ended


def clear_stop(safety: Safety, rules: Rules) -> tuple[Safety, Reason]:
    """Return the state after a request to clear the stop, and the answer to the request."""
    stop, answer = emergency_stop.clear_stop(safety.stop, rules.timeouts.command_s)
    reason = STOP_REASONS[answer]
    believed = (
        encoder_check.trust_again(safety.encoders)
        if reason is Reason.STOP_CLEARED
        else safety.encoders
    )
    return replace(safety, stop=stop, encoders=believed), reason


def begin_reset(now_s: float, safety: Safety, rules: Rules) -> tuple[Safety, Reason]:
    """Return the state with a reset under way, or unchanged, and the answer to the request."""
    silence = watchdog.find_silence(watchdog.advance_ages(safety.ages, now_s), rules.timeouts)
    refused = swing_down.find_obstacle(silence, safety.stop.latched) or _find_lasting_fault(safety)
    if refused is None and not safety.active:
        refused = Reason.RESET_INACTIVE
    if refused is not None:
        return safety, refused
    return _forget_command(replace(safety, reset=safety.reset or Reset())), Reason.RESETTING


def _compute_gap_s(safety: Safety, later_s: float, rules: Rules) -> float:
    """Return the time between the last two samples, s; a period for the first sample.

    later_s: s; how long after the last decision the new sample came.
    """
    return (
        rules.period_s
        if safety.ages.sample_s is None
        else max(safety.ages.sample_s + later_s, 0.0)
    )


def _take_inputs(
    request: float | None, fresh: FreshSample | None, now_s: float, safety: Safety, rules: Rules
) -> tuple[Safety, tuple[Reason | None, ...]]:
    """Return the state at now_s with the new command and sample, and why either was refused."""
    safety = replace(safety, ages=watchdog.advance_ages(safety.ages, now_s))
    safety, refused = (safety, None) if request is None else take_command(request, safety)
    if fresh is None:
        return safety, (refused,)
    if not fresh.sample.finite:
        counts = replace(safety.counts, samples=safety.counts.samples + 1)
        return replace(safety, counts=counts), (refused, Reason.SAMPLE_NOT_FINITE)
    checked = encoder_check.check_sample(
        safety.encoders, fresh.sample, safety.applied, fresh.gap_s, rules.encoders
    )
    # an impossible sample is none to guard the rail by
    rig = safety.rig if checked.fault else fresh.sample
    return replace(
        safety, rig=rig, encoders=checked, ages=watchdog.note_sample(safety.ages, fresh.ago_s)
    ), (refused,)


def _find_lasting_fault(safety: Safety) -> Reason | None:
    """Return the encoder fault that lasts until a person has looked; a single spike is none."""
    fault = safety.encoders.fault
    return fault if fault and fault.level is Level.ERROR else None


def _advance_reset(
    fresh: FreshSample | None, passed_s: float, safety: Safety, rules: Rules
) -> tuple[Safety, Reason | None]:
    """Return the state after another moment of a reset, and how it ended; None if it goes on."""
    if safety.reset is None:
        return safety, None
    reset = swing_down.let_time_pass(safety.reset, passed_s)
    if fresh is not None and fresh.sample is safety.rig:
        reset = swing_down.swing_on(reset, fresh.sample, safety.applied, fresh.gap_s, rules.swing)
    silence = watchdog.find_silence(safety.ages, rules.timeouts)
    ended = (
        swing_down.find_obstacle(silence, stopped=False)
        or _find_lasting_fault(safety)
        or swing_down.find_end(reset, rules.swing)
    )
    return replace(safety, reset=None if ended else reset), ended


def _find_reason_for_zero(safety: Safety, rules: Rules) -> Reason | None:
    """Return why PWM is 0: stop, no last word, watchdog or encoders; None for no reason."""
    if safety.stop.latched:
        return Reason.STOPPED
    if not safety.last_word:
        return Reason.NO_LAST_WORD
    silence = watchdog.find_silence(safety.ages, rules.timeouts)
    if reason := silence or safety.encoders.fault:
        return reason
    if not safety.active:
        return Reason.INACTIVE
    if safety.reset:
        return None
    if two_writers.has_two_writers(safety.writers, safety.ages.now_s):
        return Reason.TWO_WRITERS
    return watchdog.find_missing_command(safety.ages, rules.timeouts)


def _forget_command(safety: Safety) -> Safety:
    """Return the state without a command to apply."""
    return replace(safety, command=0.0, ages=watchdog.forget_command(safety.ages))


def _list_reasons(*reasons: Reason | None) -> tuple[Reason, ...]:
    """Return the reasons that are not None, each once."""
    return tuple(dict.fromkeys(reason for reason in reasons if reason is not None))
