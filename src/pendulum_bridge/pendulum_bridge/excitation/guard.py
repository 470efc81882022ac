"""When an excitation has to be stopped, and why: decisions on what a rig shows while a plan is played on it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import Enum

from pendulum_bridge.safety.rig_state import RigState
from pendulum_twin.errors import BadInputError

SAMPLES_BEYOND_IN_A_ROW = (
    2  # so many samples beyond a bound: a single one may be a spike of the encoder
)
RECENT_S = 0.1  # what was asked for within this time may be what is applied now
UNEQUAL_PWM = 0.02  # PWM; smaller differences between asked and applied do not count


class StopReason(Enum):
    """Why a plan was not begun or not played to its end; each a sentence for a person. Whoever plays it then sends 0."""

    CART_TOO_FAR = "The cart came too near the end of the rail"
    CART_TOO_FAST = "The cart is too fast"
    POLE_TOO_FAST = "The pole is too fast"
    NOT_MOVED = "The first push did not move the cart: see that the drive is on and the cart free"
    OVERRULED = "The driver has sent something else than it was asked for too long: a limit, the rail guard or another sender"
    EMERGENCY_STOP = "The emergency stop is latched"
    DRIVER_ERROR = "The driver reports an error"
    SAMPLES_MISSING = "The rig's samples are missing"
    SAMPLE_MALFORMED = "A sample could not be read"
    RATE_WRONG = "The rig's samples do not come at the rate of the plan"
    NOT_READY = "The plan could not begin"
    RESET_FAILED = "The reset before the plan failed"
    ABORTED = "The plan was aborted by request"
    INTERRUPTED = "The plan was interrupted by a signal"
    FAILED = "The node itself failed"


@dataclass(frozen=True)
class Stopped:
    """Hold why a plan was stopped and what was found, with units; nothing when there is no more to say."""

    reason: StopReason
    found: str = ""

    @property
    def sentence(self) -> str:
        """Return both as a sentence."""
        return f"{self.reason.value}{f' ({self.found})' if self.found else ''}."


@dataclass(frozen=True)
class Bounds:
    """Hold what a rig may do while a plan is played.

    far_m: of the cart from the middle. cart_m_s, pole_rad_s: speeds. silence_s: longest time
    without a sample.
    overruled_s: how much longer than it was obeyed the driver may send something else. Raises
    BadInputError for a bound that is NaN or not above 0.
    """

    far_m: float
    cart_m_s: float = 5.0
    pole_rad_s: float = 40.0
    silence_s: float = 0.2
    overruled_s: float = 0.5

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not value > 0:
                raise BadInputError(f"{name}: expected a number above 0, found {value!r}")


@dataclass(frozen=True)
class Watch:
    """Hold what is remembered from sample to sample.

    outside: consecutive samples beyond a bound. overruled_s: for how much longer something else
    was applied than what was asked for. asked: commands (PWM fraction) of the last RECENT_S, the
    newest last.
    """

    outside: int = 0
    overruled_s: float = 0.0
    asked: tuple[float, ...] = (0.0,)


def find_exceeded_bound(state: RigState, bounds: Bounds) -> Stopped | None:
    """Return which bound a sample lies beyond; None when it lies within all."""
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


def watch_sample(
    state: RigState, applied: float, period_s: float, watch: Watch, bounds: Bounds
) -> tuple[Watch, Stopped | None]:
    """Return the watch after a sample, period_s after the last, and why to stop now; None when all is well.

    applied: PWM fraction, the last that the driver said it has sent.
    """
    found = find_exceeded_bound(state, bounds)
    outside = watch.outside + 1 if found else 0
    change = -period_s if is_obeyed(applied, watch.asked) else period_s
    watch = replace(watch, outside=outside, overruled_s=max(watch.overruled_s + change, 0.0))
    if found and outside >= SAMPLES_BEYOND_IN_A_ROW:
        return watch, found
    if watch.overruled_s > bounds.overruled_s:
        return watch, Stopped(
            StopReason.OVERRULED, f"asked for {watch.asked[-1]:.3g}, sent {applied:.3g}"
        )
    return watch, None


def note_request(command: float, period_s: float, watch: Watch) -> Watch:
    """Return the watch after a command was asked for."""
    kept = math.ceil(RECENT_S / period_s) + 1
    return replace(watch, asked=(*watch.asked, command)[-kept:])


def is_obeyed(applied: float, asked: tuple[float, ...]) -> bool:
    """Tell whether what is applied is one of the recent commands or between two of them.

    Between: a driver whose slew is limited passes from one to the next, which is no reason to
    stop.
    """
    return min(asked) - UNEQUAL_PWM <= applied <= max(asked) + UNEQUAL_PWM


def find_missing_samples(gap_s: float, bounds: Bounds) -> Stopped | None:
    """Return why to stop after so long without a sample; None when it is not long."""
    if gap_s <= bounds.silence_s:
        return None
    return Stopped(
        StopReason.SAMPLES_MISSING, f"none for {gap_s:.2g} s, at most {bounds.silence_s:.2g} s"
    )
