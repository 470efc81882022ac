"""The constants of the decisions, and the state between two of them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from pendulum_bridge.safety import encoder_check
from pendulum_bridge.safety.cart_direction import CartDirection
from pendulum_bridge.safety.encoder_check import EncoderCheck, Encoders
from pendulum_bridge.safety.limits import Limits, check_command_unit
from pendulum_bridge.safety.rail_guard import RailGuard, make_rail_guard
from pendulum_bridge.safety.reasons import Reason
from pendulum_bridge.safety.reset import Reset, SwingDown, make_swing_down
from pendulum_bridge.safety.rig_state import RigState
from pendulum_bridge.safety.two_writers import Writers
from pendulum_bridge.safety.watchdog import Ages, Timeouts
from pendulum_twin.emergency_stop import Stop
from pendulum_twin.rig import Rig


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
    after_standstill: commands that had waited, or may have while the driver stood still.
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
    direction: which way the cart moves, as its motion shows.
    applied: PWM fraction; what was sent last.
    unused_s: s; time left over for slewing, see `limits.compute_left_s`.
    in_vain_s: s; how long the rail guard has pushed without effect.
    writers: who has sent commands lately.
    resumed_s: s, monotonic; when the last standstill of the driver ended, or it was activated.
    last_word: why nobody sends PWM 0 when the driver no longer can; None while somebody does.
    counts: what was refused.
    active: whether commands and resets are accepted.
    command_ages_s: s; of the last commands, see `command_waits`.
    """

    ages: Ages
    stop: Stop = Stop()  # noqa: RUF009 (frozen)
    reset: Reset | None = None
    command: float = 0.0
    rig: RigState | None = None
    encoders: Encoders = Encoders()  # noqa: RUF009 (frozen)
    direction: CartDirection = CartDirection()  # noqa: RUF009 (frozen)
    applied: float = 0.0
    unused_s: float = 0.0
    in_vain_s: float = 0.0
    writers: Writers = Writers()  # noqa: RUF009 (frozen)
    resumed_s: float = -math.inf
    last_word: Reason | None = None
    counts: Counts = Counts()
    active: bool = True
    command_ages_s: tuple[float, ...] = ()


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

    Raises BadInputError when the rig lacks constants that the rules need, or its commands are no
    PWM fractions.
    """
    check_command_unit(rig)
    limit = min(limits.magnitude, rig.pwm_limit or limits.magnitude)
    guard = make_rail_guard(rig, limit, way=way, pole_way=pole_way)
    swing_plan = make_swing_down(rig, limit, way, pole_way, reset_deadline_s)
    check = encoder_check.make_encoder_check(rig, limit, period_s)
    return Rules(replace(limits, magnitude=limit), timeouts, guard, swing_plan, check, period_s)


def make_safety(now_s: float) -> Safety:
    """Return the state at the start (now_s: s, monotonic): nothing was heard or sent yet."""
    return Safety(Ages(now_s))
