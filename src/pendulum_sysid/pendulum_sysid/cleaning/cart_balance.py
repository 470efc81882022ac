"""Terms of the cart's balance, straight from the samples, and errors of weights fitted to them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import correlate1d

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.earlier_samples import find_earlier_samples
from pendulum_sysid.cleaning.smooth_state import SmoothState
from pendulum_sysid.cleaning.stale_start import compute_slow_speed, list_brakes
from pendulum_twin.arrays import Floats, Ints
from pendulum_twin.signals import Signals

DIFFERENCE_S = 0.01  # s


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


@dataclass(frozen=True)
class SecondDifferences:
    """Hold the cart's balance in second differences, which no smoothing has touched.

    size: samples of the differences.
    rows: (rows,) samples inside a stretch, measured, that mostly move.
    target: (rows,) m/s^2, the cart's acceleration.
    others: (rows, columns) of what moves the cart beside the command.
    stretch_begins: first sample of every stretch; no command acts in a later stretch.
    """

    size: int
    rows: Ints
    target: Floats
    others: Floats
    stretch_begins: tuple[int, ...]

    def list_answers(self, command: Floats) -> Floats:
        """Return what a held command (n,) was around each row, at once and later, (rows, delays).

        Of each difference the mean of the command over the samples before and after.
        """
        kernel = np.concatenate([np.full(2 * self.size, 0.5 / self.size), np.zeros(1)])
        around = np.concatenate(
            [
                correlate1d(part, kernel, mode="nearest")
                for part in np.split(command, self.stretch_begins[1:])
            ]
        )
        latest = round(decisions.ANSWER_LATEST_S / DIFFERENCE_S) * self.size
        delays = np.arange(0, latest + 1, self.size)
        return around[find_earlier_samples(self.rows[:, None], delays, self.stretch_begins)]


def make_second_differences(signals: Signals, state: SmoothState) -> SecondDifferences:
    """Return the balance over `DIFFERENCE_S`: shorter differences show more noise."""
    assert signals.cart is not None
    size = max(round(DIFFERENCE_S / signals.period_s), 1)
    rows = choose_rows(signals, state, np.ones(2 * size + 1) / (2 * size + 1))
    target = differentiate_twice(signals.cart, signals.period_s, size)[rows]
    others = list_other_forces(signals, state, size)[rows]
    return SecondDifferences(size, rows, target, others, signals.stretch_begins)


def choose_rows(signals: Signals, state: SmoothState, weights: Floats) -> Ints:
    """Return the samples whose filter lies inside a stretch, on valid samples that mostly move."""
    half = len(weights) // 2
    still = np.abs(state.states[:, 2]) < compute_slow_speed(state)
    invalid = (
        ~signals.cart_valid
        if signals.pole is None
        else ~signals.cart_valid | (~signals.pole_valid)
    )
    inside = [
        np.arange(s.start + half, s.stop - half, max(half // 2, 1)) for s in signals.stretches
    ]
    rows = np.concatenate(inside).astype(np.int64)
    at_rest, missing = (
        correlate1d(mask.astype(np.float64), weights, mode="nearest")[rows]
        for mask in (still, invalid)
    )
    return rows[(at_rest <= decisions.ANSWER_REST_SHARE) & (missing < 1e-9)]


def compute_covariance(columns: Floats, left: Floats, block: Ints) -> Floats:
    """Return the covariance of least-squares weights, errors independent by block (a sandwich).

    columns: (rows, k). left: (rows,) remainders. block: (rows,) number of each row's block.
    """
    own = block - block.min()
    scores = np.stack([np.bincount(own, weights=column * left) for column in columns.T], axis=1)
    bread = np.linalg.pinv(columns.T @ columns)
    covariance: Floats = bread @ scores.T @ scores @ bread
    return covariance


def compute_jackknife_covariance(columns: Floats, target: Floats, block: Ints) -> Floats:
    """Return the covariance of least-squares weights by leaving out one block after the other.

    A sandwich is certain of a column that lives in a single block, whose errors are fitted away.
    Without the block nothing fixes that weight, and the jackknife knows it (Efron, The Jackknife,
    the Bootstrap and Other Resampling Plans (1982), chapter 3).

    columns: (rows, k), of a mean square near 1. target: (rows,). block: (rows,).
    """
    parts = [np.flatnonzero(block == number) for number in np.unique(block)]
    normals = np.stack([columns[part].T @ columns[part] for part in parts])
    slopes = np.stack([columns[part].T @ target[part] for part in parts])
    ridge = 1e-9 * len(target) * np.eye(columns.shape[1])
    others = normals.sum(axis=0) - normals + ridge
    without = np.linalg.solve(others, (slopes.sum(axis=0) - slopes)[..., None])[..., 0]
    apart = without - without.mean(axis=0)
    covariance: Floats = (len(parts) - 1) / len(parts) * apart.T @ apart
    return covariance
