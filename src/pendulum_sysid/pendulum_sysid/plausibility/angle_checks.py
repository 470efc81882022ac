"""Whether the angle's column holds an angle in radians, and 0 is upright."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.smooth_state import smooth_state
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.plausibility.answers import Check, CheckAnswer
from pendulum_sysid.plausibility.balances import PoleBalance, balance_pole
from pendulum_sysid.plausibility.swings import swings_widely
from pendulum_sysid.plausibility.units import (
    LENGTH_UNITS,
    advise_option,
    is_near,
    measure_length_unit,
)
from pendulum_twin.arrays import Floats, Mask
from pendulum_twin.signals import Signals

DEGREES, TURN = 180.0 / math.pi, 2.0 * math.pi


def check_pole_columns(case: Case, as_it_is: PoleBalance) -> Check | None:
    """Ask whether the angle's column holds an angle in radians."""
    signals = case.signals
    if signals.pole is None:
        return None
    question, expected = "Is it an angle in radians?", "an angle in rad that moves as a pole does"
    observed = f"{as_it_is.explained:.0%} of its acceleration explained by the pole's equation"
    explained = as_it_is.explained > decisions.BALANCE_UNSURE
    has_known_zero = not (
        decisions.ZERO_DOUBT_RAD < as_it_is.hangs_off_rad < math.pi - decisions.ZERO_CERTAIN_RAD
    )
    if explained and has_known_zero:
        return Check(question, CheckAnswer.YES, expected, observed)
    for advice, other in _list_other_readings(signals).items():
        balance = balance_pole(other, smooth_state(other))
        hangs = balance.hangs_off_rad < decisions.ZERO_CERTAIN_RAD or not explained
        sure = balance.explained >= decisions.BALANCE_SURE
        if sure and hangs and is_near(balance, case, decisions.FREQUENCY_FACTOR):
            observed += f", {balance.explained:.0%} if read otherwise"
            return Check(question, CheckAnswer.NO, expected, observed, advice)
    if explained:
        return Check(question, CheckAnswer.YES, expected, observed)
    advice = "check the column, unit and scale of --pole, and whether its encoder counts both ways"
    foreign = as_it_is.explained < decisions.BALANCE_FOREIGN and swings_widely(signals)
    return Check(
        question, CheckAnswer.NO if foreign else CheckAnswer.DOUBT, expected, observed, advice
    )


def _list_other_readings(signals: Signals) -> dict[str, Signals]:
    """Return the signals with the angle in other units, and with both positions exchanged."""
    if signals.pole is None:
        return {}
    degrees = replace(signals, pole=_restore_turns(signals.pole, signals.pole_valid) / DEGREES)
    readings = {advise_option("--angle-unit deg"): degrees}
    readings[advise_option("--angle-unit turn")] = replace(signals, pole=signals.pole * TURN)
    if signals.cart is not None:
        exchanged = replace(
            signals,
            cart=signals.pole,
            pole=signals.cart,
            cart_valid=signals.pole_valid,
            pole_valid=signals.cart_valid,
        )
        readings["the columns of --cart and --pole are exchanged: import them anew"] = exchanged
    return readings


def _restore_turns(angle: Floats, valid: Mask) -> Floats:
    """Put back the multiples of 2 pi that cleaning took out of the steps of an angle in degrees.

    Speed is continuous, so each step is near the last. A step that is near neither neighbour is a
    spike or a whole turn of 360: the speed carries on over it.
    """
    steps = np.diff(angle)
    changes = np.abs(np.diff(steps) - TURN * np.rint(np.diff(steps) / TURN))
    calm = np.concatenate([[True], changes < decisions.DEGREES_STEP_CHANGE, [True]])
    good = valid[1:] & valid[:-1] & (calm[1:] | calm[:-1])
    if not np.any(good):
        return angle
    at = np.flatnonzero(good)
    followed = np.interp(np.arange(len(steps)), at, np.unwrap(steps[at], period=TURN))
    return angle[0] + np.concatenate([[0.0], np.cumsum(followed)])


def check_pole_zero(case: Case, balance: PoleBalance) -> Check | None:
    """Ask whether the pole stands upright at 0."""
    signals = case.signals
    if signals.pole is None:
        return None
    question, expected = "Is the angle 0 upright?", "a pole that hangs at pi and falls away from 0"
    advice = advise_option("--pole-zero down", "(with up, if it was imported with down)")
    if balance.explained < decisions.BALANCE_SURE or not is_near(balance, case, math.inf):
        if not _rests_upright(case):
            return None
        observed = "a pole that rests upright without a command"
        return Check(question, CheckAnswer.DOUBT, expected, observed, advice)
    observed = f"a pole that hangs at {(balance.upright_rad + math.pi) % TURN:.3g} rad"
    off_zero = math.pi - balance.hangs_off_rad
    if balance.hangs_off_rad <= decisions.ZERO_DOUBT_RAD:
        return Check(question, CheckAnswer.YES, expected, observed)
    if off_zero >= decisions.ZERO_DOUBT_RAD:
        advice = (
            "check the sensor's zero; an angle of --sin and --cos that were exchanged hangs a "
            "quarter turn off"
        )
        return Check(question, CheckAnswer.DOUBT, expected, observed, advice)
    certain = (
        off_zero < decisions.ZERO_CERTAIN_RAD
        and is_near(balance, case, decisions.FREQUENCY_FACTOR)
        and _is_coupled(balance, case)
    )
    return Check(
        question, CheckAnswer.NO if certain else CheckAnswer.DOUBT, expected, observed, advice
    )


def _is_coupled(balance: PoleBalance, case: Case) -> bool:
    """Tell whether the cart's acceleration shows in the pole's about as the twin says.

    A controller that holds the pole upright makes cart and angle move as one. Where the cart's
    acceleration is mostly noise, such a pole looks as if it swung about 0, but little coupled.
    """
    if case.signals.cart is None or not np.any(case.state.accelerations[:, 0]):
        return True
    unit = measure_length_unit(case, balance, math.nan)
    if unit is None:
        return False
    shortfall = min(abs(math.log(unit / count)) for count in (1.0, *LENGTH_UNITS.values()))
    return shortfall <= math.log(decisions.FREQUENCY_FACTOR)


def _rests_upright(case: Case) -> bool:
    """Tell whether the pole stands still near 0 while there is no command."""
    signals, states = case.signals, case.state.states
    samples = max(round(decisions.REST_SECONDS / signals.period_s), 1)
    deviations = case.state.deviations
    still = (
        (signals.command == 0.0)
        & signals.pole_valid
        & (np.abs(np.remainder(states[:, 1] + math.pi, TURN) - math.pi) < decisions.REST_RAD)
        & (np.abs(states[:, 3]) < max(decisions.REST_RAD_S, 3.0 * float(deviations[3])))
    )
    runs = np.convolve(still, np.ones(samples), mode="valid")
    return bool(runs.size and runs.max() >= samples - 0.5)
