"""Whether the reported velocities lag behind the motion that the reported positions show.

No mechanics is asked: the velocity is the positions' own derivative, smoothed. Against it stand
what a rig may report without a filter, the derivative or the difference of the last two positions,
each by a pure delay if need be, and the same through a first-order lag.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.signal import lfilter

from pendulum_sysid.fitting.windows import SmoothState, channels
from pendulum_sysid.records import Estimate, Ints, Recording
from pendulum_twin.effects import velocity_filter
from pendulum_twin.signals import Floats, Mask, Signals

EFFECT = velocity_filter.EFFECT.name
LONGEST_S = 0.5
BLOCK_S = 0.5
SURE = 5.0  # standard errors over blocks by which the lag must be ahead
WORTH = 1.3  # ... and this factor of error power
WILD = 5.0  # times the median error: what lies further out counts as that far


@dataclass(frozen=True)
class Lag:
    """Hold the lag found: its time constant (s) with its interval, and how far it is ahead of no lag.

    ratio: of root mean square errors. errors: standard errors over blocks.
    """

    time_constant_s: Estimate
    ratio: float
    errors: float


Model = Callable[
    [float, float], Floats
]  # pure delay s, time constant s -> reported velocities (n, joints)


def velocity_lag(recording: Recording, state: SmoothState) -> Lag | None:
    """Return the lag of the reported velocities; None when none is reported, or no lag is needed to explain them."""
    signals, rates = recording.signals, recording.rates
    if rates is None:
        return None
    joints = [k for k in channels(signals) if np.isfinite(rates[:, k]).mean() > 0.5]
    if not joints:
        return None
    reported, usable = rates[:, joints], _usable(signals, rates[:, joints])
    scale = np.array([np.std(state.states[usable, k + 2]) or 1.0 for k in joints])

    def errors(delay_s: float, time_constant_s: float) -> Floats:
        made = _reported(
            signals, state.states[:, [k + 2 for k in joints]], delay_s, time_constant_s
        )
        return ((reported - made) / scale)[usable]

    return _judged(signals, errors, usable)


def _usable(signals: Signals, reported: Floats) -> Mask:
    """Return the samples that count: reported, valid, and far enough from a stretch's ends for the derivative."""
    usable = np.all(np.isfinite(reported), axis=1)
    for there, valid in ((signals.cart, signals.cart_valid), (signals.pole, signals.pole_valid)):
        if there is not None:
            usable &= valid
    edge = max(round(0.2 / signals.period_s), 1)
    for stretch in signals.stretches:
        usable[stretch.start : stretch.start + edge] = False
        usable[max(stretch.stop - edge, stretch.start) : stretch.stop] = False
    return usable


def _reported(signals: Signals, rates: Floats, delay_s: float, time_constant_s: float) -> Floats:
    """Return what a rig with these velocities reports, (n, joints)."""
    made = np.empty_like(rates)
    keep = float(np.exp(-signals.period_s / time_constant_s)) if time_constant_s > 0 else 0.0
    for stretch in signals.stretches:
        part = rates[stretch]
        n = np.arange(len(part), dtype=np.float64)
        for k in range(part.shape[1]):
            late = np.interp(n - delay_s / signals.period_s, n, part[:, k])
            made[stretch, k] = lfilter([1.0 - keep], [1.0, -keep], late, zi=[keep * late[0]])[0]
    return made


def _judged(
    signals: Signals, errors: Callable[[float, float], Floats], usable: Mask
) -> Lag | None:
    period = signals.period_s
    block = (signals.times_s[usable] // BLOCK_S).astype(int)
    if len(np.unique(block)) < 4:
        return None

    def power(delay_s: float, time_constant_s: float) -> Floats:
        """Return each usable sample's squared error, joints together, wild ones bounded."""
        square = np.sum(errors(delay_s, time_constant_s) ** 2, axis=1)
        return np.minimum(square, WILD**2 * max(float(np.median(square)), 1e-12))

    def best(of: Callable[[float], Floats]) -> float:
        return float(
            minimize_scalar(
                lambda s: float(np.mean(of(s))), bounds=(0.0, LONGEST_S), method="bounded"
            ).x
        )

    plain = power(best(lambda s: power(s, 0.0)), 0.0)  # a mere delay, of any length
    tries = [(delay, best(lambda s, d=delay: power(d, s))) for delay in (0.0, 0.5 * period)]  # type: ignore[misc]
    delay, constant = min(tries, key=lambda one: float(np.mean(power(*one))))
    lagged = power(delay, constant)
    gains = _by_block(plain - lagged, block)
    spread = float(np.std(gains, ddof=1)) / np.sqrt(len(gains))
    ahead = float(np.mean(gains)) / max(spread, 1e-300)
    ratio = float(np.sqrt(np.mean(plain) / max(np.mean(lagged), 1e-300)))
    half = _half_width(errors, delay, constant, block)
    if ahead < SURE or ratio**2 < WORTH or constant <= half:
        return None
    return Lag(Estimate(constant, constant - half, constant + half), ratio, ahead)


def _by_block(values: Floats, block: Ints) -> Floats:
    """Return the sums of values (n,) over each block; block: (n,) rising."""
    return np.array(
        [np.sum(part) for part in np.split(values, np.flatnonzero(np.diff(block)) + 1)]
    )


def _half_width(
    errors: Callable[[float, float], Floats], delay: float, constant: float, block: Ints
) -> float:
    """Return the half width of the 95 % interval, blocks taken as independent (a sandwich)."""
    step = 1e-3 * constant + 1e-6
    off = errors(delay, constant)
    slope = (errors(delay, constant + step) - errors(delay, max(constant - step, 0.0))) / (
        2 * step
    )
    square = np.sum(off**2, axis=1)
    tame = square < WILD**2 * max(float(np.median(square)), 1e-12)
    own = np.sum(off * slope, axis=1) * tame
    scores = _by_block(own, block)
    return 1.96 * float(np.sqrt(np.sum(scores**2))) / max(float(np.sum(slope[tame] ** 2)), 1e-300)
