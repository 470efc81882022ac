"""Show the angle through a sensor that follows it with a first-order lag, and undo that.

The measured angle y follows the angle th with tau y' = th - y, its rate w with tau y'' = w - y'.
Where a single state is all there is, the pole's rate tells where the sensor is (`sensors`).

Arguments that the functions share:
theta: (sets, SIZE), parameter vectors.
lags: s by the stamps, the sensor's time constant.
"""

from __future__ import annotations

import numpy as np

from pendulum_twin.arrays import Floats
from pendulum_twin.effects import CATALOGUE
from pendulum_twin.effects.effect import Form
from pendulum_twin.parameter_vector import SLOTS
from pendulum_twin.signals import Signals

_LAGGING = [e for e in CATALOGUE if e.form is Form.LAGGING]


def compute_lags(theta: Floats) -> Floats:
    """Return the time constant of the angle's sensor, s by the stamps, (sets,)."""
    total = np.zeros(len(theta))
    for e in _LAGGING:
        total += e.law(*theta[:, SLOTS[e.name]].T)
    return total


def follow_angle(
    before: Floats, states: Floats, lags: Floats, period_s: float, paces: Floats
) -> Floats:
    """Return states (lanes, samples, 4) with the pole as its sensor shows it.

    Between two states the angle is the cubic that has both angles and both rates; the sensor's
    answer to a cubic is exact.

    before: (lanes, 4) states at the runs' start as the sensor shows them.
    states: (lanes, samples, 4) true.
    lags, paces: (lanes,), the latter s that pass per second of the stamps; lags above 0.
    """
    tau, span = (lags * paces)[:, None], (period_s * paces)[:, None]
    angle, rate = states[..., 1], states[..., 3]
    with np.errstate(all="ignore"):  # a run that diverged has states without end
        way, ends = np.diff(angle, axis=1) / span, rate[:, :-1] + rate[:, 1:]
        bend = 2.0 * (3.0 * way - ends - rate[:, :-1]) / span  # second derivative at the start
        jerk = 6.0 * (ends - 2.0 * way) / span**2
        steady = angle[:, :-1] - tau * (rate[:, :-1] - tau * (bend - tau * jerk))
        later = angle[:, 1:] - tau * (rate[:, 1:] - tau * (bend + span * jerk - tau * jerk))
        fades = np.exp(-span / tau)
        shown = np.empty_like(angle)
        shown[:, 0] = before[:, 1]
        for n in range(angle.shape[1] - 1):
            shown[:, n + 1] = later[:, n] + fades[:, 0] * (shown[:, n] - steady[:, n])
        out = states.copy()
        out[..., 1], out[..., 3] = shown, (angle - shown) / tau
    return out


def lead_angle(
    signals: Signals, states: Floats, accelerations: Floats, lag_s: float
) -> tuple[Floats, Floats]:
    """Return states (n, 4) and accelerations (n, 2) with the pole ahead of its sensor.

    They are measured, along a recording.

    accelerations: of cart, m/s^2, and pole, rad/s^2.
    """
    ahead, later = states.copy(), accelerations.copy()
    for part in signals.stretches:
        turn = accelerations[part, 1]
        ahead[part, 1] += lag_s * states[part, 3]
        ahead[part, 3] += lag_s * turn
        if len(turn) > 1:
            later[part, 1] += lag_s * np.gradient(turn, signals.period_s)
    return ahead, later


def begin_poles(
    before: Floats, ahead: Floats, delays: Floats, lags: Floats, paces: Floats
) -> tuple[Floats, Floats]:
    """Return states (runs, 4) where runs begin: as a lagging sensor receives them, and true.

    before: (runs, 4) states as the sensor shows them; ahead: (runs, 4) the same by a delay and a
        lag later, by the twin, which tells how fast the rate changes.
    delays: (runs,) s by the stamps, how much later than they are true the sensor receives them.
    lags, paces: (runs,), see `follow_angle`.

    The first state that the sensor shows is `before`. The true rate follows from the mean
    acceleration over the lag, and is off by some 0.03 rad/s at 20 ms.
    """
    delays, lags = delays * paces, lags * paces
    received = before.copy()
    turn = (ahead[:, 3] - before[:, 3]) / (delays + lags)
    received[:, 1] += lags * before[:, 3]
    received[:, 3] += lags * turn
    true = received.copy()
    true[:, 1] += delays * (received[:, 3] + 0.5 * delays * turn)
    true[:, 3] = ahead[:, 3]
    return received, true
