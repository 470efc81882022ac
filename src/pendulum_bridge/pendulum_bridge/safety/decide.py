"""What is really sent to the rig, and why: stop, watchdog, rail guard and limits put together.

The stop wins over the watchdog, the watchdog over the encoder check, that over the rail guard, and
that over the limits. Nothing here looks at a clock, a socket or a topic: whoever does passes in
what came and when, and keeps the state.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from pendulum_bridge.safety import encoder_check
from pendulum_bridge.safety import reset as swing_down
from pendulum_bridge.safety import stop as emergency_stop
from pendulum_bridge.safety import two_writers, watchdog
from pendulum_bridge.safety.encoder_check import EncoderCheck, Encoders
from pendulum_bridge.safety.limits import (
    Limits,
    compute_left_s,
    limit_command,
    find_refusal,
    compute_slewing_s,
)
from pendulum_bridge.safety.rail_guard import RailGuard, Seen, guard_command, make_rail_guard
from pendulum_bridge.safety.reasons import Level, Reason, find_worst_level
from pendulum_bridge.safety.reset import Reset, SwingDown, make_swing_down
from pendulum_bridge.safety.rig_state import RigState
from pendulum_bridge.safety.stop import Stop
from pendulum_bridge.safety.two_writers import Writers
from pendulum_bridge.safety.watchdog import Ages, Timeouts
from pendulum_twin.rig import Rig

STANDSTILL_S = (
    0.15  # without a decision for so long, the driver stood still: it decides every 30 ms
)
UNSURE_S = 1.0  # what comes so soon after a standstill may have waited through it: it counts by when it was sent


@dataclass(frozen=True)
class Rules:
    """Hold what the decisions go by; period_s: from sample to sample."""

    limits: Limits
    timeouts: Timeouts
    guard: RailGuard
    swing: SwingDown
    encoders: EncoderCheck
    period_s: float


@dataclass(frozen=True)
class Counts:
    """Count what was not taken since the start.

    commands, samples: that are no numbers. during_reset: commands then. of_two_writers: commands
    while two sent at once.
    after_standstill: commands that may have waited.
    """

    commands: int = 0
    samples: int = 0
    during_reset: int = 0
    of_two_writers: int = 0
    after_standstill: int = 0


@dataclass(frozen=True)
class Safety:
    """Hold all that is remembered from one decision to the next.

    command: the last good one (PWM fraction); it counts only while the ages say so. rig: the last
    good sample, encoders: whether samples can be believed. reset: the one under way. applied: what
    was sent last. unused_s: see `limits.left_s`.
    in_vain_s: for how long the rail guard has pushed in vain. writers: who has sent commands
    lately. resumed_s: when the last standstill ended (monotonic).
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
    counts: Counts = Counts()


@dataclass(frozen=True)
class FreshSample:
    """Hold a sample, how long ago it came, and how long after the one before, s."""

    sample: RigState
    ago_s: float
    gap_s: float


@dataclass(frozen=True)
class Decision:
    """Hold what to send (PWM fraction), the state for the next time, and why.

    reasons: the one that decided comes first. reset_ended: how a reset under way ended just now;
    None while none has.
    """

    pwm: float
    safety: Safety
    reasons: tuple[Reason, ...]
    reset_ended: Reason | None = None

    @property
    def level(self) -> Level:
        """Return the worst level of the reasons: ERROR when the watchdog has bitten."""
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
    """Return the rules for a rig: its own limit where that is lower. Raises BadInputError when it lacks what they need.

    way, pole_way: the rig's signs, see RailGuard. period_s: from sample to sample.
    reset_deadline_s: a reset is given up then.
    """
    limit = min(limits.magnitude, rig.pwm_limit or limits.magnitude)
    guard = make_rail_guard(rig, limit, way=way, pole_way=pole_way)
    swing_plan = make_swing_down(rig, limit, way, pole_way, reset_deadline_s)
    check = encoder_check.make_encoder_check(rig, limit, period_s)
    return Rules(replace(limits, magnitude=limit), timeouts, guard, swing_plan, check, period_s)


def make_safety(now_s: float) -> Safety:
    """Return the state at the start: nothing heard, nothing sent."""
    return Safety(Ages(now_s))


def decide(
    request: float | None,
    sample: RigState | None,
    now_s: float,
    safety: Safety,
    rules: Rules,
    ago_s: float = 0.0,
) -> Decision:
    """Return what to send now: stop > watchdog > encoder check > rail guard > limits.

    request: a command (PWM fraction) that has come since the last decision, None for none; when
    more have come, pass all but the last to `take_command`. sample: the same of the rig, which came
    ago_s ago. now_s: monotonic time, s.
    """
    passed_s = watchdog.compute_passed_s(safety.ages, now_s)
    came = (
        None
        if sample is None
        else FreshSample(sample, ago_s, _compute_gap_s(safety, passed_s - ago_s, rules))
    )
    if passed_s > STANDSTILL_S:
        safety = replace(safety, resumed_s=now_s)
    safety, refused = _take_inputs(request, came, now_s, safety, rules)
    safety, over = _advance_reset(came, passed_s, safety, rules)
    may_s = compute_slewing_s(safety.unused_s, passed_s, rules.period_s)
    if (nothing := _find_reason_for_zero(safety, rules)) or safety.rig is None:
        safety = replace(safety, applied=0.0, unused_s=may_s)
        return Decision(0.0, safety, _list_reasons(nothing, over, *refused), over)
    asked = safety.reset.pwm if safety.reset else safety.command
    within = limit_command(asked, safety.applied, may_s, rules.limits)
    seen = Seen(safety.rig, safety.ages.sample_s or 0.0, safety.applied)
    kept = guard_command(within.pwm, seen, safety.in_vain_s, passed_s, rules.guard)
    unused = compute_left_s(may_s, kept.pwm - safety.applied, rules.limits)
    safety = replace(safety, applied=kept.pwm, unused_s=unused, in_vain_s=kept.in_vain_s)
    mode = Reason.RESETTING if safety.reset else None
    return Decision(kept.pwm, safety, _list_reasons(kept.reason, mode, *within.reasons, *refused))


def take_command(
    command: float, safety: Safety, now_s: float | None = None, ago_s: float = 0.0
) -> tuple[Safety, Reason | None]:
    """Return the state after a command has come, and why it was refused or dropped; None when it was taken.

    now_s: when it came (monotonic, s), if that is later than the last decision. ago_s: how long
    before that it was sent, by
    clocks of two machines perhaps: it matters only after the driver has stood still.
    """
    now_s, counts = safety.ages.now_s if now_s is None else now_s, safety.counts
    if safety.stop.latched:
        return replace(
            safety, stop=emergency_stop.drop_command(safety.stop, command)
        ), Reason.DROPPED
    if (refused := find_refusal(command)) is not None:
        return replace(safety, counts=replace(counts, commands=counts.commands + 1)), refused
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
        ), Reason.COMMAND_OLD
    return replace(safety, command=command, ages=watchdog.note_command(safety.ages, now_s)), None


def hear_writer(number: int, now_s: float, safety: Safety) -> Safety:
    """Return the state after a message of a command's writer, taken or not, with the number that its writer gave it."""
    return replace(safety, writers=two_writers.hear_writer(number, now_s, safety.writers))


def press_stop(safety: Safety) -> tuple[Safety, Reason | None]:
    """Return the state with the emergency stop pressed, and how that ended a reset under way; None when there was none.

    The command held is forgotten; the next decision, which should be taken at once, sends 0.
    """
    ended = None if safety.reset is None else Reason.RESET_STOPPED
    return _forget_command(
        replace(safety, stop=emergency_stop.press_stop(safety.stop), reset=None)
    ), ended


def fail_safe(safety: Safety) -> tuple[Safety, Reason | None]:
    """Return the state after the driver itself has failed, with no command and no reset; how that ended a reset."""
    ended = None if safety.reset is None else Reason.RESET_FAILED
    return _forget_command(replace(safety, reset=None, applied=0.0)), ended


def clear_stop(safety: Safety) -> tuple[Safety, Reason]:
    """Return the state after somebody asked to clear the stop, and what came of that."""
    stop, reason = emergency_stop.clear_stop(safety.stop)
    believed = (
        encoder_check.trust_again(safety.encoders)
        if reason is Reason.STOP_CLEARED
        else safety.encoders
    )
    return replace(safety, stop=stop, encoders=believed), reason


def begin_reset(now_s: float, safety: Safety, rules: Rules) -> tuple[Safety, Reason]:
    """Return the state with a reset begun (or going on), or as it was with the reason why there can be none."""
    silence = watchdog.find_silence(watchdog.advance_ages(safety.ages, now_s), rules.timeouts)
    refused = swing_down.find_obstacle(silence, safety.stop.latched) or _find_lasting_fault(safety)
    if refused is not None:
        return safety, refused
    return _forget_command(replace(safety, reset=safety.reset or Reset())), Reason.RESETTING


def _compute_gap_s(safety: Safety, later_s: float, rules: Rules) -> float:
    """Return the time from the last sample to one that came later_s after the last decision; a period for the first."""
    return (
        rules.period_s
        if safety.ages.sample_s is None
        else max(safety.ages.sample_s + later_s, 0.0)
    )


def _take_inputs(
    request: float | None, came: FreshSample | None, now_s: float, safety: Safety, rules: Rules
) -> tuple[Safety, tuple[Reason | None, ...]]:
    """Return the state at now_s with what has come, and what of it was refused."""
    safety = replace(safety, ages=watchdog.advance_ages(safety.ages, now_s))
    safety, refused = (safety, None) if request is None else take_command(request, safety)
    if came is None:
        return safety, (refused,)
    if not came.sample.finite:
        counts = replace(safety.counts, samples=safety.counts.samples + 1)
        return replace(safety, counts=counts), (refused, Reason.SAMPLE_NOT_FINITE)
    found = encoder_check.check_sample(
        safety.encoders, came.sample, safety.applied, came.gap_s, rules.encoders
    )
    rig = (
        safety.rig if found.fault else came.sample
    )  # what cannot be true is no sample to guard the rail by
    return replace(
        safety, rig=rig, encoders=found, ages=watchdog.note_sample(safety.ages, came.ago_s)
    ), (refused,)


def _find_lasting_fault(safety: Safety) -> Reason | None:
    """Return what makes samples unbelievable until somebody has looked; a single spike does not."""
    fault = safety.encoders.fault
    return fault if fault and fault.level is Level.ERROR else None


def _advance_reset(
    came: FreshSample | None, passed_s: float, safety: Safety, rules: Rules
) -> tuple[Safety, Reason | None]:
    """Return the state after another moment of the reset under way, and how it ended; None while it goes on."""
    if safety.reset is None:
        return safety, None
    reset = swing_down.let_time_pass(safety.reset, passed_s)
    if came is not None and came.sample is safety.rig:
        reset = swing_down.swing_on(reset, came.sample, safety.applied, came.gap_s, rules.swing)
    silence = watchdog.find_silence(safety.ages, rules.timeouts)
    over = (
        swing_down.find_obstacle(silence, stopped=False)
        or _find_lasting_fault(safety)
        or swing_down.find_end(reset, rules.swing)
    )
    return replace(safety, reset=None if over else reset), over


def _find_reason_for_zero(safety: Safety, rules: Rules) -> Reason | None:
    """Return why PWM is 0: the stop, the watchdog, the encoders; None when there is something to apply."""
    if safety.stop.latched:
        return Reason.STOPPED
    silence = watchdog.find_silence(safety.ages, rules.timeouts)
    if nothing := silence or safety.encoders.fault:
        return nothing
    if safety.reset:
        return None
    if two_writers.has_two_writers(safety.writers, safety.ages.now_s):
        return Reason.TWO_WRITERS
    return watchdog.find_missing_command(safety.ages, rules.timeouts)


def _forget_command(safety: Safety) -> Safety:
    return replace(safety, command=0.0, ages=watchdog.forget_command(safety.ages))


def _list_reasons(*reasons: Reason | None) -> tuple[Reason, ...]:
    """Return the reasons there are, each once."""
    return tuple(dict.fromkeys(reason for reason in reasons if reason is not None))
