"""What is sent to the rig, and why: stop, watchdog, encoder check, rail guard and limits together.

The stop overrides the watchdog, the watchdog the encoder check, the check the rail guard, and the
guard the limits. Nothing here reads a clock, a socket or a topic: the caller passes in what came
and when, and keeps the state.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from pendulum_bridge.safety import encoder_check, two_writers, watchdog
from pendulum_bridge.safety import reset as swing_down
from pendulum_bridge.safety.cart_direction import (
    end_push,
    follow_cart,
    turn_guard,
    turn_swing_down,
)
from pendulum_bridge.safety.events import STANDSTILL_S, find_lasting_fault, take_command
from pendulum_bridge.safety.limits import compute_left_s, compute_slewing_s, limit_command
from pendulum_bridge.safety.rail_guard import Seen, guard_command
from pendulum_bridge.safety.reasons import Level, Reason, find_worst_level
from pendulum_bridge.safety.rig_state import RigState
from pendulum_bridge.safety.state import Rules, Safety
from pendulum_twin import emergency_stop


@dataclass(frozen=True)
class FreshSample:
    """Hold a sample since the last decision.

    sample: the sample.
    ago_s: s; how long ago it came.
    gap_s: s; how long after the sample before it came, at most.
    least_gap_s: s; the same, at least.
    """

    sample: RigState
    ago_s: float
    gap_s: float
    least_gap_s: float


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
    fresh = None
    if sample is not None:
        least_s = _compute_gap_s(safety, passed_s - ago_s, rules)
        fresh = FreshSample(sample, ago_s, least_s + skipped * rules.period_s, least_s)
    if passed_s > STANDSTILL_S:
        safety = replace(safety, resumed_s=now_s)
    safety = replace(safety, stop=emergency_stop.let_time_pass(safety.stop, passed_s))
    safety, refused = _take_inputs(request, fresh, now_s, safety, rules)
    safety, ended = _advance_reset(fresh, passed_s, safety, rules)
    slewing_s = compute_slewing_s(safety.unused_s, passed_s, rules.period_s)
    if (reason := _find_reason_for_zero(safety, rules)) or safety.rig is None:
        safety = replace(_note_applied(safety, 0.0), unused_s=slewing_s)
        return Decision(0.0, safety, _list_reasons(reason, ended, *refused), ended)
    wanted = safety.reset.pwm if safety.reset else safety.command
    within = limit_command(wanted, safety.applied, slewing_s, rules.limits)
    seen = Seen(safety.rig, safety.ages.sample_s or 0.0, safety.applied)
    guard = turn_guard(rules.guard, safety.direction)
    guarded = guard_command(within.pwm, seen, safety.in_vain_s, passed_s, guard)
    if guarded.reason and safety.direction.in_doubt:
        guarded = replace(guarded, pwm=0.0, reason=Reason.CART_DOUBTED)
    unused = compute_left_s(slewing_s, guarded.pwm - safety.applied, rules.limits)
    safety = _note_applied(safety, guarded.pwm)
    safety = replace(safety, unused_s=unused, in_vain_s=guarded.in_vain_s)
    mode = Reason.RESETTING if safety.reset else None
    mirrored = Reason.CART_MIRRORED if safety.direction.turned else None
    reasons = _list_reasons(guarded.reason, mode, *within.reasons, *refused, mirrored)
    return Decision(guarded.pwm, safety, reasons)


def _note_applied(safety: Safety, pwm: float) -> Safety:
    """Return the state with the command that is sent (PWM fraction)."""
    if pwm * safety.applied > 0.0:
        return replace(safety, applied=pwm)
    return replace(safety, applied=pwm, direction=end_push(safety.direction))


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
    if not checked.fault:
        direction = follow_cart(
            safety.direction,
            fresh.sample,
            safety.applied,
            fresh.least_gap_s,
            rules.period_s,
            rules.guard,
        )
        safety = replace(safety, rig=fresh.sample, direction=direction)
    ages = watchdog.note_sample(safety.ages, fresh.ago_s)
    return replace(safety, encoders=checked, ages=ages), (refused,)


def _advance_reset(
    fresh: FreshSample | None, passed_s: float, safety: Safety, rules: Rules
) -> tuple[Safety, Reason | None]:
    """Return the state after another moment of a reset, and how it ended; None if it goes on."""
    if safety.reset is None:
        return safety, None
    reset = swing_down.let_time_pass(safety.reset, passed_s)
    if fresh is not None and fresh.sample is safety.rig:
        plan = turn_swing_down(rules.swing, safety.direction)
        reset = swing_down.swing_on(reset, fresh.sample, safety.applied, fresh.gap_s, plan)
    silence = watchdog.find_silence(safety.ages, rules.timeouts)
    ended = (
        swing_down.find_obstacle(silence, stopped=False)
        or find_lasting_fault(safety)
        or swing_down.find_end(reset, rules.swing)
    )
    return replace(safety, reset=None if ended else reset), ended


def _find_reason_for_zero(safety: Safety, rules: Rules) -> Reason | None:
    """Return why PWM is 0: stop, no last word, watchdog or encoders; None for no reason."""
    if safety.stop.latched:
        return Reason.STOPPED
    if safety.last_word:
        return safety.last_word
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


def _list_reasons(*reasons: Reason | None) -> tuple[Reason, ...]:
    """Return the reasons that are not None, each once."""
    return tuple(dict.fromkeys(reason for reason in reasons if reason is not None))
