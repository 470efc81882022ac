"""What a drive with a slew limit makes of the command, from the cart's balance.

Behind a large step of the command such a drive goes on pushing the old way for a while. To a
balance with the command itself that looks like a reading that slips, or like a cart that moves
before its command. Both are asked before any physics is known, so the ramp is looked for first.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import minimize_scalar

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.cart_balance import SecondDifferences, make_second_differences
from pendulum_sysid.cleaning.encoder_steps import find_encoder_step
from pendulum_sysid.cleaning.smooth_state import SmoothState
from pendulum_twin.arrays import Floats
from pendulum_twin.effects.drive_slew_limit import EFFECT
from pendulum_twin.free_runs import run_drive
from pendulum_twin.parameter_vector import NEUTRAL, SLOTS
from pendulum_twin.signals import Signals

RAMP = SLOTS[EFFECT.name].start
(PARAMETER,) = EFFECT.parameters
# From half of the shortest typical ramp to the longest that a fit may reach, a ratio of two apart.
TRIED_S = np.geomspace(0.5 * min(PARAMETER.probes), PARAMETER.most, 7)


def follow_ramp(signals: Signals, state: SmoothState) -> Floats:
    """Return the command (n,) behind the drive's ramp, the mean of each sample period.

    The command itself, held, where no ramp explains the cart's acceleration much better. Beside a
    ramp stands any answer that is linear, for a delay or a lag is no ramp.
    """
    if signals.cart is None or not np.any(signals.command):
        return signals.command
    second = make_second_differences(signals, state)
    if len(second.rows) < decisions.ANSWER_LEAST_ROWS:
        return signals.command
    plain, rounding = _list_rests(second, signals.command), _compute_rounding(signals, second)
    # a slip, or a spike that is left, counts as an error of so much at most
    wild = decisions.SPIKE_DEVIATIONS * 1.4826 * float(np.median(np.abs(plain)))
    without = _measure_power(plain, wild) - rounding
    if without <= 0.0:
        return signals.command
    largest = float(np.max(np.abs(signals.command)))

    def measure_rest(log_ramp: float) -> float:
        limited = _limit_slew(signals, float(np.exp(log_ramp)))
        return _measure_power(_list_rests(second, limited), wild)

    tried = np.log(TRIED_S / largest)
    best = int(np.argmin([measure_rest(ramp) for ramp in tried]))
    around = (tried[max(best - 1, 0)], tried[min(best + 1, len(tried) - 1)])
    refined = minimize_scalar(measure_rest, bounds=around, method="bounded")
    if refined.fun - rounding >= decisions.LEAD_SHARE_OF_REST * without:
        return signals.command
    return _limit_slew(signals, float(np.exp(refined.x)))


def _limit_slew(signals: Signals, ramp_s: float) -> Floats:
    theta = NEUTRAL[None].copy()
    theta[0, RAMP] = ramp_s
    rows, _ = run_drive(signals, theta, signals.period_s)
    limited: Floats = rows[0].reshape(len(signals), -1).mean(axis=1)
    return limited


def _compute_rounding(signals: Signals, second: SecondDifferences) -> float:
    """Return the mean square of second differences that the rounding of positions makes."""
    rounding_m = find_encoder_step(signals.cart) / math.sqrt(12.0)
    between_s = second.size * signals.period_s
    return 6.0 * (rounding_m / between_s**2) ** 2  # the squares of 1, -2 and 1


def _list_rests(second: SecondDifferences, command: Floats) -> Floats:
    """Return the accelerations that a drive's answer does not explain, (rows,), m/s^2."""
    columns = np.column_stack([second.list_answers(command), second.others])
    weights = np.linalg.lstsq(columns, second.target, rcond=None)[0]
    rests: Floats = second.target - columns @ weights
    return rests


def _measure_power(rests: Floats, wild: float) -> float:
    """Return the mean square of errors, each of which counts as `wild` at most."""
    return float(np.mean(np.minimum(np.abs(rests), wild) ** 2))
