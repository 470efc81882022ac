"""One free run of a twin over a whole recording, and the thesis's measure of it, equation 29."""

from __future__ import annotations

import numpy as np

from pendulum_twin.arrays import Floats, Mask
from pendulum_twin.free_runs import run_freely
from pendulum_twin.signals import Signals

CART_WEIGHT, POLE_WEIGHT = 0.75, 0.25
ONE_RUN = np.zeros(1, dtype=np.int64)


def run_whole(signals: Signals, states: Floats, theta: Floats) -> Floats:
    """Run the twin freely over the whole recording; returns what its sensors show, (n, 4).

    states: (n, 4) smoothed x (m), th (rad), v (m/s), w (rad/s), of which only the first of every
        stretch is used: a break ends one run and begins another.
    theta: (SIZE,) of the twin.

    A run that diverges holds infinity or NaN from there on.
    """
    run = np.empty((len(signals), 4))
    for stretch in signals.stretches:
        part = _pick_stretch(signals, stretch)
        with np.errstate(all="ignore"):
            run[stretch] = run_freely(
                part, theta[None], ONE_RUN, ONE_RUN, states[stretch][:1], len(part)
            )[0]
    return run


def compute_equation_29(signals: Signals, run: Floats) -> float:
    """Compute the thesis's error of a run (n, 4).

    It is 0.75 RMSE(cart in m) + 0.25 (RMSE(sin pole) + RMSE(cos pole)).

    A recording of a cart alone gives RMSE(cart), of a pole alone RMSE(sin pole) + RMSE(cos pole).
    Samples that are not valid do not count. Infinite for a run that diverged.
    """
    cart = pole = 0.0
    with np.errstate(all="ignore"):
        if signals.cart is not None:
            cart = _compute_rmse(signals.cart - run[:, 0], signals.cart_valid)
        if signals.pole is not None:
            pole = _compute_rmse(np.sin(signals.pole) - np.sin(run[:, 1]), signals.pole_valid)
            pole += _compute_rmse(np.cos(signals.pole) - np.cos(run[:, 1]), signals.pole_valid)
    if signals.cart is None or signals.pole is None:
        return cart + pole
    return CART_WEIGHT * cart + POLE_WEIGHT * pole


def _pick_stretch(signals: Signals, stretch: slice) -> Signals:
    if len(signals.stretches) == 1:
        return signals
    return Signals(
        signals.period_s,
        signals.command[stretch],
        None if signals.cart is None else signals.cart[stretch],
        None if signals.pole is None else signals.pole[stretch],
        signals.cart_valid[stretch],
        signals.pole_valid[stretch],
        parts=None if signals.parts is None else signals.parts[stretch],
        begin_s=(float(signals.clock_s[stretch.start]),),
    )


def _compute_rmse(errors: Floats, valid: Mask) -> float:
    if not valid.any():
        return np.inf
    rmse = float(np.sqrt(np.mean(errors[valid] ** 2)))
    return rmse if np.isfinite(rmse) else np.inf
