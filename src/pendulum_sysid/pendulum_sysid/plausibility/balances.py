"""Fit the equations of pole and cart to the smoothed motion, without the twin."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.command_answer import make_filter
from pendulum_sysid.cleaning.smooth_state import SmoothState
from pendulum_twin.arrays import Floats, Mask
from pendulum_twin.signals import Signals


@dataclass(frozen=True)
class PoleBalance:
    """Hold how well the pole's equation of motion fits the smoothed angle.

    gravity: 1/s^2, squared frequency of the hanging pole; NaN where it does not show.
    upright_rad: rad, where the pole stands upright, -pi to pi; NaN where gravity does not show.
    coupling: 1/m, angular acceleration by the cart's acceleration; NaN where it does not show.
    explained: share of the angular acceleration's power, 0 to 1.
    coupled_share: share, 0 to 1, that the cart's acceleration takes of the power which gravity and
        friction leave; below 1 by the noise of both accelerations.
    """

    gravity: float
    upright_rad: float
    coupling: float
    explained: float
    coupled_share: float = 0.0

    @property
    def hangs_off_rad(self) -> float:
        """Return how far from pi the pole hangs, 0 to pi; NaN where that does not show."""
        return abs(self.upright_rad)

    @property
    def gravity_m_s2(self) -> tuple[float, float]:
        """Return the least and largest acceleration of gravity that the motion allows, or NaN.

        The pole's equation holds m l g / J and m l / J; their ratio is g, whatever the rig. Noise
        in the cart's acceleration makes the coupling too small: the true coupling lies between
        the fit as it is and the fit the other way round (Frisch's bounds, errors in variables).
        """
        most = self.gravity / self.coupling
        return most * self.coupled_share, most


UNKNOWN = PoleBalance(math.nan, math.nan, math.nan, 0.0)


def balance_pole(signals: Signals, state: SmoothState, part: slice = slice(None)) -> PoleBalance:
    """Fit w' = k sin(th - th0) + c cos(th - th0) v' - f w to the smoothed motion.

    Least squares, twice: the second time without the rows that the first explains worst.

    part: samples that count.
    """
    if signals.pole is None:
        return UNKNOWN
    angle, rate = state.states[:, 1], state.states[:, 3]
    forward, target = state.accelerations.T
    use = signals.pole_valid & np.isfinite(target) & np.isfinite(angle)
    use[: part.start or 0] = False
    use[part.stop or len(use) :] = False
    columns = [np.sin(angle), np.cos(angle), rate]
    if signals.cart is not None and np.any(forward):
        use &= signals.cart_valid
        columns += [np.cos(angle) * forward, np.sin(angle) * forward]
    rows = np.column_stack(columns)
    fit = _fit_robustly(rows, target, use)
    if fit is None:
        return UNKNOWN
    weights, errors, explained = fit
    if math.hypot(*weights[:2]) < decisions.SURE_STANDARD_ERRORS * math.hypot(*errors[:2]):
        return replace(UNKNOWN, explained=explained)
    coupling, share = math.nan, 0.0
    if len(weights) > 3:
        size, error = math.hypot(*weights[3:]), math.hypot(*errors[3:])
        coupling = size if size >= decisions.SURE_STANDARD_ERRORS * error else math.nan
        share = _measure_share(rows, target, use, 3)
    upright_rad = math.atan2(-weights[1], weights[0])
    return PoleBalance(math.hypot(*weights[:2]), upright_rad, coupling, explained, share)


def _measure_share(rows: Floats, target: Floats, use: Mask, others: int) -> float:
    """Return which share of the power that the first columns leave the columns after them take."""
    left = [
        wanted - columns @ np.linalg.lstsq(columns, wanted)[0]
        for wanted, columns in ((target[use], rows[use][:, :others]), (target[use], rows[use]))
    ]
    without, within = (float(np.sum(rest**2)) for rest in left)
    return 1.0 - within / without if without > 0.0 else 0.0


def measure_gain(signals: Signals, state: SmoothState) -> float:
    """Return the cart's acceleration by a unit of command, m/s^2; NaN where it does not show.

    Command and motion go through one filter: an acceleration is smoothed, and a controller's
    command that changes its sign from sample to sample would seem to do a quarter of what it does.
    """
    if signals.cart is None or not np.any(signals.command):
        return math.nan
    speed, forward = state.states[:, 2], state.accelerations[:, 0]
    at, take_mean = make_filter(signals, state)
    columns = np.column_stack([signals.command, speed, np.sign(speed), np.ones_like(speed)])
    every = np.ones(len(at), dtype=bool)
    fit = _fit_robustly(take_mean(columns), take_mean(forward), every)
    if fit is None:
        return math.nan
    weights, errors, _ = fit
    size, error = abs(float(weights[0])), float(errors[0])
    return size if size >= decisions.SURE_STANDARD_ERRORS * error else math.nan


def _fit_robustly(rows: Floats, target: Floats, use: Mask) -> tuple[Floats, Floats, float] | None:
    """Return weights, their standard errors and the explained share; None with too few rows."""
    for last in (False, True):
        if np.count_nonzero(use) < decisions.BALANCE_LEAST_ROWS:
            return None
        chosen, wanted = rows[use], target[use]
        scale = np.sqrt(np.mean(chosen**2, axis=0)) + np.finfo(float).tiny
        weights, _, rank, _ = np.linalg.lstsq(chosen / scale, wanted)
        if rank < chosen.shape[1]:
            return None
        left = np.abs(target - rows @ (weights / scale))
        if not last:
            use = use & (left <= np.quantile(left[use], 1.0 - decisions.BALANCE_TRIMMED))
    power, missing = float(np.sum(wanted**2)), float(np.sum(left[use] ** 2))
    if power == 0.0:
        return None
    spread = decisions.BALANCE_CORRELATED_SAMPLES * missing / len(wanted)
    inverse = np.linalg.pinv((chosen / scale).T @ (chosen / scale))
    errors = np.sqrt(np.maximum(np.diag(inverse), 0.0) * spread) / scale
    return weights / scale, errors, 1.0 - missing / power
