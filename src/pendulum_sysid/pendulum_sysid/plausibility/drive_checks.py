"""Whether position and command count as the twin's, and the drive is about as strong."""

from __future__ import annotations

import math

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.plausibility.answers import Check, CheckAnswer
from pendulum_sysid.plausibility.balances import PoleBalance
from pendulum_sysid.plausibility.units import (
    COMMAND_UNITS,
    LENGTH_UNITS,
    advise_option,
    measure_length_unit,
    pick_unit,
)
from pendulum_twin.parameter_vector import FORCE_PER_PWM, MASS, make_theta
from pendulum_twin.signals import Signals

IN_VOLTS = "or, if it is in volts, give pwm_limit and force_per_pwm_n of the twin file in volts"


def check_cart_range(case: Case, balance: PoleBalance, gain: float) -> Check | None:
    """Ask whether the cart stays on the twin's rail."""
    signals, half = case.signals, case.twin.rig.rail_half_length_m
    if signals.cart is None or half is None or not signals.cart_valid.any():
        return None
    travel = float(np.ptp(signals.cart[signals.cart_valid]))
    ratio = travel / (2 * half)
    question = "Is the cart's position in metres?"
    expected = f"a cart that moves over at most the rail's {2 * half:g} m"
    observed = f"{travel:.4g} m"
    if ratio <= decisions.RAIL_SLACK:
        return Check(question, CheckAnswer.YES, expected, observed)
    units = {name: count for name, count in LENGTH_UNITS.items() if ratio / count <= 1.1}
    by_motion = measure_length_unit(case, balance, gain)
    option = next(iter(units), None) if by_motion is None else pick_unit(by_motion, units)
    advice = "check the column and unit of --cart, and rail_half_length_m of the twin file"
    advice = advise_option(option) if option else advice
    if ratio > decisions.RAIL_SLACK and _goes_one_way(signals):
        observed += ", all of it one way"
        advice = "a cart on a rail comes back: its encoder counts without a direction"
        return Check(question, CheckAnswer.NO, expected, observed, advice)
    certain = ratio > decisions.RAIL_CERTAIN and option is not None
    answer = CheckAnswer.NO if certain or ratio > decisions.RAIL_IMPOSSIBLE else CheckAnswer.DOUBT
    return Check(question, answer, expected, observed, advice)


def _goes_one_way(signals: Signals) -> bool:
    """Tell whether the cart's position only ever rises, or only falls, but for noise."""
    assert signals.cart is not None
    samples = max(round(decisions.ANSWER_FILTER_S / signals.period_s), 1)
    ways = np.diff(signals.cart[signals.cart_valid][::samples])
    return abs(float(ways.sum())) > decisions.ONE_WAY_SHARE * float(np.abs(ways).sum())


def check_command_range(case: Case, gain: float) -> Check | None:
    """Ask whether the command keeps to the twin's limit."""
    limit, signals = case.twin.rig.pwm_limit, case.signals
    if signals.cart is None or limit is None or not np.any(signals.command):
        return None
    most = float(np.max(np.abs(signals.command)))
    question = "Does the command count as the twin's?"
    expected, observed = f"commands up to the twin's pwm_limit of {limit:g}", f"{most:.4g}"
    if most <= decisions.COMMAND_SLACK * limit:
        return Check(question, CheckAnswer.YES, expected, observed)
    units = {name: n for name, n in COMMAND_UNITS.items() if most / limit / n <= 1.1}
    theta = make_theta(case.twin)
    own = float(theta[FORCE_PER_PWM] / theta[MASS])
    ratio = own / gain if gain > 0.0 and own > 0.0 else 1.0
    option = pick_unit(ratio, units)
    advice = "check the column of --command, and pwm_limit and force_per_pwm_n of the twin file"
    if option is not None:
        advice = advise_option(option, IN_VOLTS)
    certain = most > decisions.COMMAND_CERTAIN * limit and ratio > decisions.COMMAND_CERTAIN
    answer = CheckAnswer.NO if certain else CheckAnswer.DOUBT
    return Check(question, answer, expected, observed, advice)


def check_drive(case: Case, gain: float) -> Check | None:
    """Ask whether the cart answers a command about as strongly as the twin file says."""
    theta = make_theta(case.twin)
    own = float(theta[FORCE_PER_PWM] / theta[MASS])
    if not (gain > 0.0 and own > 0.0):
        return None
    question = "Is the drive about as strong as the twin's?"
    expected = f"about {own:.3g} m/s^2 a unit of command (force_per_pwm_n over the moved mass)"
    observed = f"{gain:.3g}"
    if abs(math.log(gain / own)) <= math.log(decisions.GAIN_FACTOR):
        return Check(question, CheckAnswer.YES, expected, observed)
    advice = "check the units of position and command, and force_per_pwm_n of the twin file"
    return Check(question, CheckAnswer.DOUBT, expected, observed, advice)
