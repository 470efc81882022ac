"""What is really sent to the rig, and why: stop, watchdog, rail guard and limits put together.

The stop wins over the watchdog, the watchdog over the rail guard, the rail guard over the limits. Nothing here looks at
a clock, a socket or a topic: whoever does passes in what came and when, and keeps the state for the next time.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from pendulum_bridge import reset as swing
from pendulum_bridge import stop as emergency
from pendulum_bridge import watchdog
from pendulum_bridge.limits import Limits, limited, refusal
from pendulum_bridge.rail_guard import RailGuard, Seen, guarded, rail_guard
from pendulum_bridge.reasons import Level, Reason, worst
from pendulum_bridge.reset import Reset, SwingDown, swing_down
from pendulum_bridge.rig_state import RigState
from pendulum_bridge.stop import Stop
from pendulum_bridge.watchdog import Ages, Timeouts
from pendulum_twin.rig import Rig


@dataclass(frozen=True)
class Rules:
    """Hold all that does not change while the driver runs."""

    limits: Limits
    timeouts: Timeouts
    guard: RailGuard
    swing: SwingDown


@dataclass(frozen=True)
class Counts:
    """Count what was refused since the start: commands and samples that are no numbers, commands during a reset."""

    commands: int = 0
    samples: int = 0
    during_reset: int = 0


@dataclass(frozen=True)
class Safety:
    """Hold all that is remembered from one decision to the next.

    command: the last good one (PWM fraction); it counts only while the ages say so. rig: the last good sample. reset:
    the one under way. applied: what was sent last. in_vain_s: for how long the rail guard has pushed in vain.
    """

    ages: Ages
    stop: Stop = Stop()  # noqa: RUF009 (frozen)
    reset: Reset | None = None
    command: float = 0.0
    rig: RigState | None = None
    applied: float = 0.0
    in_vain_s: float = 0.0
    counts: Counts = Counts()


@dataclass(frozen=True)
class Decision:
    """Hold what to send (PWM fraction), the state for the next time, and why.

    reasons: the one that decided comes first. reset_ended: how a reset under way ended just now; None while none has.
    """

    pwm: float
    safety: Safety
    reasons: tuple[Reason, ...]
    reset_ended: Reason | None = None

    @property
    def level(self) -> Level:
        """Return the worst level of the reasons: ERROR when the watchdog has bitten."""
        return worst(self.reasons)


def rules_for(
    rig: Rig,
    limits: Limits = Limits(),  # noqa: B008 (frozen)
    timeouts: Timeouts = Timeouts(),  # noqa: B008 (frozen)
    way: int = 1,
    pole_way: int = 1,
) -> Rules:
    """Return the rules for a rig: its own limit where that is lower. Raises BadInputError when it lacks what they need.

    way, pole_way: the rig's signs, see RailGuard.
    """
    limit = min(limits.magnitude, rig.pwm_limit or limits.magnitude)
    guard = rail_guard(rig, limit, way=way, pole_way=pole_way)
    swing_plan = swing_down(rig, limit, way=way, pole_way=pole_way)
    return Rules(replace(limits, magnitude=limit), timeouts, guard, swing_plan)


def at_start(now_s: float) -> Safety:
    """Return the state at the start: nothing heard, nothing sent."""
    return Safety(Ages(now_s))


def decided(request: float | None, sample: RigState | None, now_s: float, safety: Safety, rules: Rules) -> Decision:
    """Return what to send now: stop > watchdog > rail guard > limits.

    request: a command (PWM fraction) that has come since the last decision, None for none; when more have come, pass
    all but the last to `commanded`. sample: the same of the rig. now_s: monotonic time, s.
    """
    passed_s = watchdog.passed_s(safety.ages, now_s)
    safety, refused = _heard(request, sample, now_s, safety)
    safety, over = _reset_moved_on(sample, passed_s, safety, rules)
    if (nothing := _why_nothing(safety, rules)) or safety.rig is None:
        safety = replace(safety, applied=0.0)
        return Decision(0.0, safety, _known(nothing, over, *refused), over)
    asked = safety.reset.pwm if safety.reset else safety.command
    within = limited(asked, safety.applied, passed_s, rules.limits)
    seen = Seen(safety.rig, safety.ages.sample_s or 0.0, safety.applied)
    kept = guarded(within.pwm, seen, safety.in_vain_s, passed_s, rules.guard)
    safety = replace(safety, applied=kept.pwm, in_vain_s=kept.in_vain_s)
    mode = Reason.RESETTING if safety.reset else None
    return Decision(kept.pwm, safety, _known(kept.reason, mode, *within.reasons, *refused))


def commanded(command: float, safety: Safety) -> tuple[Safety, Reason | None]:
    """Return the state after a command has come, and why it was refused or dropped; None when it was taken."""
    counts = safety.counts
    if safety.stop.latched:
        return replace(safety, stop=emergency.dropping(safety.stop, command)), Reason.DROPPED
    if (refused := refusal(command)) is not None:
        return replace(safety, counts=replace(counts, commands=counts.commands + 1)), refused
    if safety.reset is not None:
        return replace(safety, counts=replace(counts, during_reset=counts.during_reset + 1)), Reason.RESETTING
    return replace(safety, command=command, ages=watchdog.command_came(safety.ages)), None


def stopped(safety: Safety) -> tuple[Safety, Reason | None]:
    """Return the state with the emergency stop pressed, and how that ended a reset under way; None when there was none.

    The command held is forgotten; the next decision, which should be taken at once, sends 0.
    """
    ended = None if safety.reset is None else Reason.RESET_STOPPED
    return _without_command(replace(safety, stop=emergency.pressed(safety.stop), reset=None)), ended


def stop_cleared(safety: Safety) -> tuple[Safety, Reason]:
    """Return the state after somebody asked to clear the stop, and what came of that."""
    stop, reason = emergency.cleared(safety.stop)
    return replace(safety, stop=stop), reason


def reset_asked(now_s: float, safety: Safety, rules: Rules) -> tuple[Safety, Reason]:
    """Return the state with a reset begun (or going on), or as it was with the reason why there can be none."""
    silence = watchdog.silence(watchdog.aged(safety.ages, now_s), rules.timeouts)
    refused = swing.given_up(silence, safety.stop.latched)
    if refused is not None:
        return safety, refused
    return _without_command(replace(safety, reset=safety.reset or Reset())), Reason.RESETTING


def _heard(
    request: float | None, sample: RigState | None, now_s: float, safety: Safety
) -> tuple[Safety, tuple[Reason | None, ...]]:
    """Return the state at now_s with what has come, and what of it was refused."""
    safety = replace(safety, ages=watchdog.aged(safety.ages, now_s))
    safety, refused = (safety, None) if request is None else commanded(request, safety)
    if sample is None:
        return safety, (refused,)
    if not sample.finite:
        counts = replace(safety.counts, samples=safety.counts.samples + 1)
        return replace(safety, counts=counts), (refused, Reason.SAMPLE_NOT_FINITE)
    return replace(safety, rig=sample, ages=watchdog.sample_came(safety.ages)), (refused,)


def _reset_moved_on(sample: RigState | None, passed_s: float, safety: Safety, rules: Rules) -> tuple[Safety, Reason | None]:
    """Return the state after another moment of the reset under way, and how it ended; None while it goes on."""
    if safety.reset is None:
        return safety, None
    reset = swing.waited(safety.reset, passed_s)
    if sample is not None and sample.finite:
        reset = swing.swung(safety.reset, sample, safety.applied, passed_s, rules.swing)
    silence = watchdog.silence(safety.ages, rules.timeouts)
    over = swing.given_up(silence, stopped=False) or swing.ended(reset, rules.swing)
    return replace(safety, reset=None if over else reset), over


def _why_nothing(safety: Safety, rules: Rules) -> Reason | None:
    """Return why PWM is 0: the stop, then the watchdog; None when there is something to apply."""
    if safety.stop.latched:
        return Reason.STOPPED
    silence = watchdog.silence(safety.ages, rules.timeouts)
    return silence or (None if safety.reset else watchdog.command_missing(safety.ages, rules.timeouts))


def _without_command(safety: Safety) -> Safety:
    return replace(safety, command=0.0, ages=watchdog.command_forgotten(safety.ages))


def _known(*reasons: Reason | None) -> tuple[Reason, ...]:
    """Return the reasons there are, each once."""
    return tuple(dict.fromkeys(reason for reason in reasons if reason is not None))
