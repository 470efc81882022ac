"""Whether the cart follows the command at all: asked of the cart's whole equation of motion.

A correlation of command and acceleration fails in closed loop with dry friction: near upright the
command answers the pole, the pole pushes the cart, and while the cart sticks no command moves it.
So the pole's reaction stands in the equation, what stands still is left out, and all terms go
through one filter (the weak form): the second derivative of an encoder is mostly noise.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.ndimage import correlate1d

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.cart_balance import (
    choose_rows,
    compute_covariance,
    compute_jackknife_covariance,
    list_reactions,
    make_second_differences,
)
from pendulum_sysid.cleaning.drive_curve import bend_command, fit_drive_curve
from pendulum_sysid.cleaning.earlier_samples import delay_samples
from pendulum_sysid.cleaning.smooth_state import SmoothState
from pendulum_sysid.cleaning.stale_start import LATER_S, list_brakes
from pendulum_sysid.errors import UnusableRecording
from pendulum_twin.arrays import Floats, Ints, Mask
from pendulum_twin.signals import Signals

# More steps pick rows that agree by chance: ten steps to half of the rows take wrong commands to
# 15 standard errors.
TRIMMING_STEPS = 3
NO_ANSWER = (
    "expected the cart to follow the command, found it moving no more by it than without: "
    "check the command topic, the stamps, the drive and the encoders, and whether the cart hits "
    "something"
)


def check_follows_command(signals: Signals, state: SmoothState) -> None:
    """Raise UnusableRecording when there is a cart that moves no more by the command."""
    if signals.cart is not None and not follows_command(signals, state):
        raise UnusableRecording(NO_ANSWER)


def follows_command(signals: Signals, state: SmoothState) -> bool:
    """Tell whether the command explains the cart's acceleration, as late as it may come.

    Brakes, a spring and the pole explain it as well: a controller's command opposes a cable that
    pulls the cart back, and without the spring the two seem to do nothing.

    The weight of the command in the least-squares balance of the cart must be certain, with errors
    independent from block to block (a sandwich). If it is not, the command gets more weights: a
    second, times the position, for the drive's gain may change along the rail, up to its sign; or
    those of a curve, for a drive with a dead zone answers the strong pushes of a swing-up and few
    of the small commands that balance the pole; or the rows that are explained worst are left out,
    for no command explains how a cart hits a buffer. True where the cart moves too little to tell.
    Where nothing is commanded, brakes and the pole have to explain most of the acceleration.
    """
    rows, take_mean = make_filter(signals, state)
    if len(rows) < decisions.ANSWER_LEAST_ROWS:
        return True
    target = take_mean(state.accelerations[:, 0])
    position = state.states[:, 0]
    brakes, reactions = list_brakes(state), list_reactions(signals, state)
    others = take_mean(np.column_stack([brakes, position, reactions]))
    if not np.any(signals.command):
        left = target - others @ np.linalg.lstsq(others, target, rcond=None)[0]
        return float(np.mean(left**2)) < decisions.UNCOMMANDED_MOST_LEFT * float(
            np.mean(target**2)
        )
    block = (signals.times_s[rows] // decisions.ERROR_BLOCK_S).astype(int)
    step = max(round(LATER_S / signals.period_s), 1)
    latest = round(decisions.ANSWER_LATEST_S / signals.period_s)
    commands = [
        delay_samples(signals.command, late, signals.stretch_begins)
        for late in range(0, latest + 1, step)
    ]

    def is_certain(list_drives: Callable[[Floats], Floats], trimmed: float = 0.0) -> bool:
        """Return whether what is listed of a command, (n,) to (n, k), explains the cart."""
        fits = [
            _fit_balance(take_mean(list_drives(command)), others, target, block, trimmed)
            for command in commands
        ]
        return min(fits)[1] > decisions.ANSWER_STANDARD_ERRORS

    return (
        is_certain(lambda command: command[:, None])
        or is_certain(lambda command: command[:, None], decisions.ANSWER_TRIMMED)
        or is_certain(lambda command: np.column_stack([command, command * position]))
        or is_certain(lambda command: bend_command(command, signals.command))
    )


def is_moved_uncommanded(
    signals: Signals, state: SmoothState, begin_s: float, end_s: float
) -> bool:
    """Tell whether the cart moves as if commanded while no command is recorded.

    The balance of the cart is fitted outside the interval (s) and judged inside: a rig that is
    left alone keeps to it with a command of 0.
    """
    rows, take_mean = make_filter(signals, state)
    inside = (signals.clock_s[rows] >= begin_s) & (signals.clock_s[rows] <= end_s)
    if not np.any(inside) or np.count_nonzero(~inside) < decisions.ANSWER_LEAST_ROWS:
        return False
    target = take_mean(state.accelerations[:, 0])
    others = take_mean(np.column_stack([list_brakes(state), list_reactions(signals, state)]))
    columns = np.column_stack([take_mean(signals.command), others])
    weights = np.linalg.lstsq(columns[~inside], target[~inside], rcond=None)[0]
    left = np.abs(target - columns @ weights)
    most = decisions.UNCOMMANDED_RATIO * float(np.sqrt(np.mean(left[~inside] ** 2)))
    return bool(np.mean(left[inside] > most) > decisions.UNCOMMANDED_SHARE)


def measure_unexplained(signals: Signals, state: SmoothState) -> float:
    """Return the cart's acceleration, m/s^2, that commands leave unexplained as they are timed.

    It compares timings of the same commands to a fraction of a period, so the acceleration is that
    of neighbouring samples. The drive may bend commands by a static curve, and commands may come
    late, through a lag or a belt: every sample of the last 0.2 s has a weight of its own (a finite
    impulse response).
    """
    assert signals.cart is not None
    second = make_second_differences(signals, state)
    if len(second.rows) < decisions.ANSWER_LEAST_ROWS:
        return np.inf
    driven = fit_drive_curve(signals.command, second).answer(signals.command)
    columns = np.column_stack([second.list_answers(driven), second.others])
    weights = np.linalg.lstsq(columns, second.target, rcond=None)[0]
    return float(np.std(second.target - columns @ weights))


def make_filter(signals: Signals, state: SmoothState) -> tuple[Ints, Callable[[Floats], Floats]]:
    """Return the samples that are asked, (rows,), and the filter: (n, ...) to (rows, ...).

    The samples lie inside stretches, a quarter of the filter apart, where the cart mostly moves.
    """
    half = max(round(0.5 * decisions.ANSWER_FILTER_S / signals.period_s), 2)
    weights = np.hanning(2 * half + 3)[1:-1]
    weights /= weights.sum()
    rows = choose_rows(signals, state, weights)

    def take_mean(values: Floats) -> Floats:
        means: Floats = correlate1d(values, weights, axis=0, mode="nearest")
        return means[rows]

    return rows, take_mean


def _fit_balance(
    driven: Floats, others: Floats, target: Floats, block: Ints, trimmed: float
) -> tuple[float, float]:
    """Return what is left of the target, m/s^2, and the command's weights in standard errors.

    driven: (rows, weights) by which the command acts.
    trimmed: share of the rows, the worst explained, that are left out.

    Several weights count together: the root of Wald's statistic per weight.
    """
    columns = np.column_stack([driven, others])
    columns = columns / (np.sqrt(np.mean(columns**2, axis=0)) + np.finfo(float).tiny)
    if trimmed:
        usual = _pick_usual_rows(columns, target, trimmed)
        columns, target, block = columns[usual], target[usual], block[usual]
    weights = np.linalg.lstsq(columns, target, rcond=None)[0]
    left = target - columns @ weights
    count = driven.shape[1]
    covariance = (
        compute_jackknife_covariance(columns, target, block)
        if count > 2  # a curve: few commands lie beyond its last bends, and in few blocks
        else compute_covariance(columns, left, block)
    )
    own, covariance = weights[:count], covariance[:count, :count]
    wald = float(own @ np.linalg.pinv(covariance, hermitian=True) @ own)
    return float(np.std(left)), float(np.sqrt(max(wald, 0.0) / count))


def _pick_usual_rows(columns: Floats, target: Floats, trimmed: float) -> Mask:
    """Return the rows, (rows,), without the share that is explained worst.

    Least trimmed squares (Rousseeuw and Van Driessen, Data Min. Knowl. Discov. 12 (2006) 29):
    weights that are fitted to the usual rows say which rows are usual.
    """
    usual = np.ones(len(target), dtype=bool)
    for _ in range(TRIMMING_STEPS):
        weights = np.linalg.lstsq(columns[usual], target[usual], rcond=None)[0]
        left = np.abs(target - columns @ weights)
        usual = left <= np.quantile(left, 1.0 - trimmed)
    return usual
