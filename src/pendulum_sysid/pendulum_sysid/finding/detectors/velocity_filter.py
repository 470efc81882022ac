"""Find a filter of the reported velocities: their lag behind the reported positions.

No mechanics is needed: the true velocity is the positions' own derivative, smoothed. It is
compared with what a rig may report without a filter (the derivative or the difference of the last
two positions, each with a pure delay) and with the same through a first-order lag.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_banded
from scipy.optimize import minimize_scalar

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.smooth_state import SmoothState
from pendulum_sysid.finding.detectors.detector import Detector, Reading, Sight, Use
from pendulum_sysid.finding.judge import Lead
from pendulum_sysid.fitting.windows import list_channels
from pendulum_sysid.records import Estimate, Recording
from pendulum_twin.arrays import Floats, Ints, Mask
from pendulum_twin.effects import velocity_filter
from pendulum_twin.signals import Signals

EFFECT = velocity_filter.EFFECT

# (pure delay s, time constant s) -> errors (samples, joints), or their power (samples,)
Errors = Callable[[float, float], Floats]


@dataclass(frozen=True)
class Lag:
    """Hold a lag of the reported velocities.

    time_constant_s: with its 95 % interval.
    ratio: root mean square error without the lag over that with it.
    standard_errors: by which the lag is ahead, over blocks.
    """

    time_constant_s: Estimate
    ratio: float
    standard_errors: float


def read_filter(sight: Sight) -> tuple[Reading, ...]:
    """Return the filter of the reported velocities, where one is needed to explain them."""
    lag = find_velocity_lag(sight.case.recording, sight.case.state)
    if lag is None:
        return ()
    estimates = {EFFECT.parameters[0].name: lag.time_constant_s}
    lead = Lead(lag.ratio, lag.standard_errors)
    return (Reading(EFFECT.name, (lag.time_constant_s.value,), estimates, lead),)


def find_velocity_lag(recording: Recording, state: SmoothState) -> Lag | None:
    """Return the lag of the reported velocities; None when there are none, or no lag is needed."""
    signals, rates = recording.signals, recording.rates
    if rates is None or _has_doubtful_times(recording):
        return None
    joints = [k for k in list_channels(signals) if np.isfinite(rates[:, k]).mean() > 0.5]
    if not joints:
        return None
    reported, usable = rates[:, joints], _find_usable(signals, rates[:, joints])
    true = state.states[:, [k + 2 for k in joints]]
    scale = np.array([np.std(column[usable]) or 1.0 for column in true.T])

    def compute_errors(delay_s: float, time_constant_s: float) -> Floats:
        return ((reported - _report(signals, true, delay_s, time_constant_s)) / scale)[usable]

    return _judge_lag(signals, compute_errors, usable)


def _has_doubtful_times(recording: Recording) -> bool:
    """Tell whether stamps are uneven and no even clock mends them: they blur the derivative."""
    jitters = any(finding.kind == "jitter" for finding in recording.findings)
    return jitters and recording.timing_spread_s == 0.0


def _find_usable(signals: Signals, reported: Floats) -> Mask:
    """Return the samples that count: reported, valid, and far enough from a stretch's ends."""
    usable = np.all(np.isfinite(reported), axis=1)
    for values, valid in ((signals.cart, signals.cart_valid), (signals.pole, signals.pole_valid)):
        if values is not None:
            usable &= valid
    edge = max(round(0.2 / signals.period_s), 1)
    for stretch in signals.stretches:
        usable[stretch.start : stretch.start + edge] = False
        usable[max(stretch.stop - edge, stretch.start) : stretch.stop] = False
    return usable


def _report(signals: Signals, rates: Floats, delay_s: float, time_constant_s: float) -> Floats:
    """Return what a rig with these velocities reports, (samples, joints)."""
    reported = np.empty_like(rates)
    keep = float(np.exp(-signals.period_s / time_constant_s)) if time_constant_s > 0 else 0.0
    for stretch in signals.stretches:
        n = np.arange(stretch.stop - stretch.start, dtype=np.float64)
        at = n - delay_s / signals.period_s
        late = np.column_stack(
            [np.interp(at, n, rates[stretch, k]) for k in range(rates.shape[1])]
        )
        driven = (1.0 - keep) * late
        driven[0] += keep * late[0]
        diagonals = np.array([np.ones(len(n)), np.full(len(n), -keep)])
        reported[stretch] = solve_banded((1, 0), diagonals, driven)  # y_k - keep y_k-1 = driven_k
    return reported


def _judge_lag(signals: Signals, compute_errors: Errors, usable: Mask) -> Lag | None:
    """Return the lag that explains the reported velocities best, where it is clearly needed."""
    block = (signals.times_s[usable] // decisions.ERROR_BLOCK_S).astype(int)
    if len(np.unique(block)) < 4:
        return None

    def compute_power(delay_s: float, time_constant_s: float) -> Floats:
        """Return each usable sample's squared error, joints together, wild samples bounded."""
        square = np.sum(compute_errors(delay_s, time_constant_s) ** 2, axis=1)
        return np.minimum(square, decisions.LAG_WILD**2 * max(float(np.median(square)), 1e-12))

    delayed = compute_power(_minimise(lambda s: compute_power(s, 0.0)), 0.0)
    lags = [(late, _fit_constant(compute_power, late)) for late in (0.0, 0.5 * signals.period_s)]
    delay, constant = min(lags, key=lambda lag: float(np.mean(compute_power(*lag))))
    lagged = compute_power(delay, constant)
    gains = _sum_blocks(delayed - lagged, block)
    spread = float(np.std(gains, ddof=1)) / np.sqrt(len(gains))
    ahead = float(np.mean(gains)) / max(spread, 1e-300)
    ratio = float(np.sqrt(np.mean(delayed) / max(np.mean(lagged), 1e-300)))
    half = _compute_half_width(compute_errors, delay, constant, block)
    half = float(np.hypot(half, _compute_averaging(signals.period_s, constant)))
    if (
        ahead < decisions.SURE_STANDARD_ERRORS
        or ratio**2 < decisions.LAG_POWER_RATIO
        or constant <= half
    ):
        return None
    return Lag(Estimate(constant, constant - half, constant + half), ratio, ahead)


def _fit_constant(compute_power: Errors, delay_s: float) -> float:
    """Return the time constant (s) with which the errors are least beside a pure delay."""
    return _minimise(lambda s: compute_power(delay_s, s))


def _minimise(compute_power: Callable[[float], Floats]) -> float:
    """Return the time (s), at most `LAG_LONGEST_S`, for which the mean power is least."""
    minimum = minimize_scalar(
        lambda s: float(np.mean(compute_power(s))),
        bounds=(0.0, decisions.LAG_LONGEST_S),
        method="bounded",
    )
    return float(minimum.x)


def _sum_blocks(values: Floats, block: Ints) -> Floats:
    """Return the sums of values (samples,) over each block; block: (samples,) rising."""
    return np.add.reduceat(values, np.concatenate([[0], np.flatnonzero(np.diff(block)) + 1]))


def _compute_averaging(period_s: float, constant_s: float) -> float:
    """Return the half width (s) that a mean over a period adds, for a 95 % interval.

    A rig may report the velocity at the middle of a period or its mean over the period: the mean
    has the second moment T^2 / 12 more, and that of a lag is tau^2.
    """
    return decisions.INTERVAL_DEVIATIONS * period_s**2 / (24.0 * max(constant_s, 1e-9))


def _compute_half_width(
    compute_errors: Errors, delay: float, constant: float, block: Ints
) -> float:
    """Return the half width of the 95 % interval, blocks taken as independent (a sandwich)."""
    step = 1e-3 * constant + 1e-6
    low, high = max(constant - step, 0.0), constant + step
    errors = compute_errors(delay, constant)
    slope = (compute_errors(delay, high) - compute_errors(delay, low)) / (2 * step)
    square = np.sum(errors**2, axis=1)
    tame = square < decisions.LAG_WILD**2 * max(float(np.median(square)), 1e-12)
    scores = _sum_blocks(np.sum(errors * slope, axis=1) * tame, block)
    deviation = float(np.sqrt(np.sum(scores**2))) / max(float(np.sum(slope[tame] ** 2)), 1e-300)
    return decisions.INTERVAL_DEVIATIONS * deviation


DETECTOR = Detector(EFFECT, Use.NAME, read_filter)
