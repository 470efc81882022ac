"""Terms of the cart's balance, straight from the samples, and errors of weights fitted to them."""

from __future__ import annotations

import numpy as np

from pendulum_sysid.cleaning.smooth_state import SmoothState
from pendulum_sysid.cleaning.stale_start import list_brakes
from pendulum_twin.arrays import Floats, Ints
from pendulum_twin.signals import Signals


def differentiate_twice(values: Floats, period_s: float, size: int) -> Floats:
    """Return second differences over so many samples, (n,), per s^2; 0 at the ends.

    Of a held command they show the mean over that many samples before and after.
    """
    second = np.zeros(len(values))
    second[size:-size] = values[2 * size :] - 2 * values[size:-size] + values[: -2 * size]
    return second / (size * period_s) ** 2


def list_other_forces(signals: Signals, state: SmoothState, size: int) -> Floats:
    """Return what moves the cart beside the command, (n, 3), with a pole (n, 5): brakes, pole.

    size: samples of the differences.
    """
    brakes = list_brakes(state)
    if signals.pole is None:
        return brakes
    angle = signals.pole
    reaction = np.cos(angle) * differentiate_twice(angle, signals.period_s, size)
    swing = np.sin(angle) * state.states[:, 3] ** 2
    return np.column_stack([brakes, reaction, swing])


def list_reactions(signals: Signals, state: SmoothState) -> Floats:
    """Return by what the pole pushes the cart, up to a factor, (n, 2); (n, 0) without a pole.

    Of the smoothed motion.
    """
    if signals.pole is None:
        return np.empty((len(signals), 0))
    angle, rate = state.states[:, 1], state.states[:, 3]
    return np.column_stack([np.cos(angle) * state.accelerations[:, 1], np.sin(angle) * rate**2])


def compute_covariance(columns: Floats, left: Floats, block: Ints) -> Floats:
    """Return the covariance of least-squares weights, errors independent by block (a sandwich).

    columns: (rows, k). left: (rows,) remainders. block: (rows,) number of each row's block.
    """
    own = block - block.min()
    scores = np.stack([np.bincount(own, weights=column * left) for column in columns.T], axis=1)
    bread = np.linalg.pinv(columns.T @ columns)
    covariance: Floats = bread @ scores.T @ scores @ bread
    return covariance
