"""When an excitation has to be stopped, and why: decisions on each sample of a plan."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import Enum

from pendulum_bridge.safety.rig_state import RigState
from pendulum_twin.errors import BadInputError

# samples beyond a bound that stop the plan: a single sample may be a spike of the encoder
SAMPLES_BEYOND_IN_A_ROW = 2
# a sample that is stamped so much before the last one shows that its clock was set back: samples
# come in the order of their stamps, however long they wait
SET_BACK_S = 0.2
RECENT_S = 0.1  # age of the requests that may be applied now
# of the rail's half length; farther out a plan does not begin, as its first push has no room: on a
# tilted rail of 0.9 m the rail guard refuses a part of it from 0.5 m on, and a cart that begins at
# 0.8 m goes the other way
NEAR_SHARE = 0.5
UNEQUAL_PWM = 0.02  # PWM fraction, see `Bounds.unequal`


class StopReason(Enum):
    """Name in a sentence why a plan did not begin or end; the player then sends 0."""

    CART_TOO_FAR = "The cart came too near the end of the rail"
    CART_TOO_FAST = "The cart is too fast"
    POLE_TOO_FAST = "The pole is too fast"
    NOT_MOVED = "The first push did not move the cart: see that the drive is on and the cart free"
    OVERRULED = (
        "The driver has sent something else than it was asked for too long: a limit, the rail "
        "guard or another sender"
    )
    EMERGENCY_STOP = "The emergency stop is latched"
    DRIVER_ERROR = "The driver reports an error"
    SAMPLES_MISSING = "The rig's samples are missing"
    CLOCK_SET_BACK = "The clock of the rig's samples was set back"
    SAMPLE_MALFORMED = "A sample could not be read"
    RATE_WRONG = "The rig's samples do not come at the rate of the plan"
    PUSH_UNEVEN = "The first push was not sent evenly, so it cannot show the cart's direction"
    NOT_READY = "The plan could not begin"
    CART_AWAY = "The cart is away from the middle of the rail when the plan should begin"
    RESET_FAILED = "The reset before the plan failed"
    ABORTED = "The plan was aborted by request"
    INTERRUPTED = "The plan was interrupted by a signal"
    FAILED = "The node itself failed"


@dataclass(frozen=True)
class Stopped:
    """Hold why a plan was stopped.

    reason: the reason.
    detail: what was measured, with units; empty when there is no more to say.
    """

    reason: StopReason
    detail: str = ""

    @property
    def sentence(self) -> str:
        """Reason and detail as a sentence."""
        return f"{self.reason.value}{f' ({self.detail})' if self.detail else ''}."


@dataclass(frozen=True)
class Bounds:
    """Hold what a rig may do while a plan is played.

    far_m: m; largest distance of the cart from the middle.
    near_m: m; largest distance of the cart from the middle when the plan begins.
    cart_m_s: m/s; largest speed of the cart.
    pole_rad_s: rad/s; largest rate of the pole.
    silence_s: s; longest time without a new sample.
    overruled_s: s; how much longer than it obeys the driver may send another command.
    unequal: PWM fraction, or the unit of the rig's command; smaller differences between request
        and applied do not count.

    Raises BadInputError for a bound that is NaN or not above 0.
    """

    far_m: float
    near_m: float = math.inf
    cart_m_s: float = 5.0
    pole_rad_s: float = 40.0
    silence_s: float = 0.2
    overruled_s: float = 0.5
    unequal: float = UNEQUAL_PWM

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not value > 0:
                raise BadInputError(f"{name}: expected a number above 0, found {value!r}")


@dataclass(frozen=True)
class Watch:
    """Hold the state between two samples.

    outside: consecutive samples beyond a bound.
    overruled_s: s; how much longer than the requested command another command was applied.
    requests: PWM fractions requested in the last RECENT_S, the newest last.
    """

    outside: int = 0
    overruled_s: float = 0.0
    requests: tuple[float, ...] = (0.0,)


def find_exceeded_bound(state: RigState, bounds: Bounds) -> Stopped | None:
    """Return which bound a sample exceeds; None when it is within all."""
    if abs(state.cart_m) > bounds.far_m:
        return Stopped(
            StopReason.CART_TOO_FAR,
            f"{state.cart_m:.3g} m from the middle, at most {bounds.far_m:.3g} m",
        )
    if abs(state.cart_m_s) > bounds.cart_m_s:
        return Stopped(
            StopReason.CART_TOO_FAST,
            f"{state.cart_m_s:.3g} m/s, at most {bounds.cart_m_s:.3g} m/s",
        )
    if abs(state.pole_rad_s) > bounds.pole_rad_s:
        return Stopped(
            StopReason.POLE_TOO_FAST,
            f"{state.pole_rad_s:.3g} rad/s, at most {bounds.pole_rad_s:.3g} rad/s",
        )
    return None


def is_near_middle(state: RigState, bounds: Bounds) -> bool:
    """Return whether a plan may begin with the cart where it is."""
    return abs(state.cart_m) <= bounds.near_m


def make_cart_away(state: RigState, bounds: Bounds, advice: str) -> Stopped:
    """Return that the cart is away from the middle when the plan should begin.

    advice: what follows the distances: what was tried, and what to do.
    """
    return Stopped(
        StopReason.CART_AWAY,
        f"expected at most {bounds.near_m:.3g} m, found {abs(state.cart_m):.2g} m{advice}",
    )


def watch_sample(
    state: RigState, applied: float, period_s: float, watch: Watch, bounds: Bounds
) -> tuple[Watch, Stopped | None]:
    """Return the watch after a sample, and why to stop now; None when all is well.

    applied: PWM fraction; what the driver last reported as sent.
    period_s: s, since the last sample.
    """
    exceeded = find_exceeded_bound(state, bounds)
    outside = watch.outside + 1 if exceeded else 0
    change = -period_s if is_obeyed(applied, watch.requests, bounds.unequal) else period_s
    watch = replace(watch, outside=outside, overruled_s=max(watch.overruled_s + change, 0.0))
    if exceeded and outside >= SAMPLES_BEYOND_IN_A_ROW:
        return watch, exceeded
    if watch.overruled_s > bounds.overruled_s:
        return watch, Stopped(
            StopReason.OVERRULED, f"asked for {watch.requests[-1]:.3g}, sent {applied:.3g}"
        )
    return watch, None


def note_request(command: float, period_s: float, watch: Watch) -> Watch:
    """Return the watch after a command (PWM fraction) was requested."""
    kept = math.ceil(RECENT_S / period_s) + 1
    return replace(watch, requests=(*watch.requests, command)[-kept:])


def is_obeyed(applied: float, requests: tuple[float, ...], unequal: float = UNEQUAL_PWM) -> bool:
    """Tell whether the applied command is a recent request or between two of them.

    Between: a driver whose slew is limited passes from one request to the next.
    """
    return min(requests) - unequal <= applied <= max(requests) + unequal


def find_missing_samples(gap_s: float, bounds: Bounds) -> Stopped | None:
    """Return why to stop after gap_s (s) without a new sample; None when that is short."""
    if gap_s <= bounds.silence_s:
        return None
    return Stopped(
        StopReason.SAMPLES_MISSING,
        f"no new one for {gap_s:.2g} s, at most {bounds.silence_s:.2g} s",
    )


def find_clock_set_back(behind_s: float) -> Stopped | None:
    """Return why to stop after a sample stamped behind_s (s) before the last; None when near."""
    if behind_s <= SET_BACK_S:
        return None
    return Stopped(
        StopReason.CLOCK_SET_BACK,
        f"expected stamps that go on, found one {behind_s:.3g} s before the last: see that "
        "nothing sets the clock meanwhile, then play the plan again",
    )
