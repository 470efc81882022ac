"""Show the angle late: a run shows where the pole was, and begins where the pole is by then.

Where a single state is all there is, the pole's rate tells where it was (`sensors`).

Arguments that the functions share:
theta: (sets, SIZE), parameter vectors.
delays: s by the stamps, how much later than the position the angle is read.
"""

from __future__ import annotations

import numpy as np

from pendulum_twin.arrays import Floats, Ints
from pendulum_twin.effects import CATALOGUE
from pendulum_twin.effects.effect import Form
from pendulum_twin.parameter_vector import NEUTRAL, SLOTS
from pendulum_twin.signals import Signals

_LATE = [e for e in CATALOGUE if e.form is Form.LATE]
_BEHIND = [e for e in CATALOGUE if e.form in (Form.LATE, Form.LAGGING)]
_COLUMNS: Ints = np.concatenate([np.r_[SLOTS[e.name]] for e in _BEHIND]).astype(np.int64)
POLE = [1, 3]  # columns of the pole in a state
FINEST_S = 1e-9  # of a delay: in less time a pole hardly moves, and counts of steps overflow


def compute_delays(theta: Floats) -> Floats:
    """Return how much later than the position the angle is read, s by the stamps, (sets,)."""
    total = np.zeros(len(theta))
    for e in _LATE:
        total += e.law(*theta[:, SLOTS[e.name]].T)
    return total


def drop_delays(theta: Floats) -> Floats:
    """Return twins that read the angle as they read the position, (sets, SIZE)."""
    in_time = theta.copy()
    in_time[:, _COLUMNS] = NEUTRAL[_COLUMNS]
    return in_time


def look_back(
    before: Floats, states: Floats, delays: Floats, period_s: float, paces: Floats
) -> Floats:
    """Return true states (lanes, samples, 4) with the pole as it was a delay ago.

    Between two states the angle is the cubic that has both angles and both rates.

    before: (lanes, 4) the true state at a delay before the run's start.
    states: (lanes, samples, 4) true.
    delays, paces: (lanes,), the latter s that pass per second of the stamps; delays above 0.
    """
    since_s = np.arange(states.shape[1]) * period_s - delays[:, None]
    k = np.floor(since_s / period_s)
    early = since_s < 0.0
    lane, at = np.arange(len(states))[:, None], np.maximum(k.astype(np.int64), 0)
    end = np.minimum(np.where(early, 0, at + 1), states.shape[1] - 1)
    a = np.where(early[..., None], before[:, None], states[lane, at])[..., POLE]
    b = states[lane, end][..., POLE]
    span = np.where(early, delays[:, None], period_s)
    way = np.where(early, since_s + delays[:, None], since_s - k * period_s) / span
    shown = states.copy()
    shown[..., POLE] = _follow_cubic(a, b, span * paces[:, None], way)
    return shown


def look_ahead(
    signals: Signals, states: Floats, accelerations: Floats, delay_s: float
) -> tuple[Floats, Floats]:
    """Return states (n, 4) and accelerations (n, 2) with the pole as it will be a delay later.

    They are measured, along a recording; a stretch ends as its last states move on.

    accelerations: of cart, m/s^2, and pole, rad/s^2.
    """
    ahead, later = states.copy(), accelerations.copy()
    for part in signals.stretches:
        at = np.arange(part.stop - part.start) + delay_s / signals.period_s
        if len(at) < 2:
            continue
        k = np.minimum(at.astype(np.int64), len(at) - 2)
        pole, way = states[part][:, POLE], at - k
        period_s = np.full(len(at), signals.period_s)
        inside = _follow_cubic(pole[k], pole[k + 1], period_s, np.minimum(way, 1.0))
        beyond_s = np.maximum(way - 1.0, 0.0) * signals.period_s
        inside[:, 0] += beyond_s * inside[:, 1]
        ahead[part, POLE] = inside
        turn = accelerations[part, 1]
        later[part, 1] = turn[k] + np.minimum(way, 1.0) * (turn[k + 1] - turn[k])
    return ahead, later


def _follow_cubic(a: Floats, b: Floats, span: Floats, way: Floats) -> Floats:
    """Return angle and rate (..., 2) on the way from a to b, (..., 2) each (Hermite).

    span: (...) s from a to b; way: (...) share of it, 0 to 1.
    """
    rest = 1.0 - way
    with np.errstate(all="ignore"):  # a run that diverged has states without end
        steep = b[..., 0] - a[..., 0]
        left = span * a[..., 1] - steep
        right = steep - span * b[..., 1]
        bend = rest * left + way * right
        angle = a[..., 0] + way * (steep + rest * bend)
        rate = (steep + (rest - way) * bend + way * rest * (right - left)) / span
    return np.stack([angle, rate], axis=-1)
