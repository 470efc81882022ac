"""The filter of a balance: as narrow as the sensors' noise allows, taken where samples count."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.smoothing import HALF_LENGTHS
from pendulum_sysid.fitting.case import Case
from pendulum_twin.arrays import Floats, Ints, Mask
from pendulum_twin.inverse_dynamics import STANDING_SPEED_SHARE
from pendulum_twin.parameter_vector import COUPLING, INERTIA, MASS
from pendulum_twin.sensors import undo_sensors

FORCE, TORQUE = 0, 1  # the equations
EDGE = 1  # samples to either side of a difference
MOST_ROWS = 20_000


@dataclass(frozen=True)
class Sieve:
    """Hold the filter of a balance.

    weights: (2 L + 1,) that add up to 1.
    at: (rows,) samples at which the filter is taken.
    """

    weights: Floats
    at: Ints

    def __call__(self, columns: Floats) -> Floats:
        """Return columns (n,) or (n, k) filtered, (rows,) or (rows, k)."""
        reach = len(self.weights) // 2
        filtered = np.zeros((len(self.at), *columns.shape[1:]))
        for weight, offset in zip(self.weights, range(-reach, reach + 1), strict=True):
            filtered += weight * columns.take(self.at + offset, axis=0)
        return filtered


def make_sieve(case: Case, theta: Floats, own: Floats, equation: int) -> tuple[Sieve, float]:
    """Return the narrowest filter that leaves little noise in an equation, and this noise.

    own: (n,) mass (inertia) times acceleration, beside which noise is little.
    """
    period_s = case.signals.period_s
    reaches = [h for h in HALF_LENGTHS if h * period_s <= decisions.SIEVE_WIDEST_S] or [
        HALF_LENGTHS[0]
    ]
    longest = round(decisions.SIEVE_WIDEST_S / period_s)
    reaches += [h for h in range(2 * reaches[-1], longest, reaches[-1])]
    for reach in reaches:
        weights = np.hanning(2 * reach + 3)[1:-1]
        weights /= weights.sum()
        noise = _compute_noise(case, theta, weights, equation)
        usable = np.arange(reach, len(own) - reach, reach)
        sieve = Sieve(weights, usable)
        if noise < decisions.SIEVE_NOISE_SHARE * np.sqrt(np.mean(sieve(own) ** 2)):
            break
    return Sieve(weights, _choose_rows(case, theta, weights, equation)), noise


def _compute_noise(case: Case, theta: Floats, weights: Floats, equation: int) -> float:
    """Return the deviation that the sensors' noise leaves in a filtered force or torque."""
    gain = np.linalg.norm(np.convolve([1.0, -2.0, 1.0], weights)) / case.signals.period_s**2
    cart, pole = (
        gain * (noise or 0.0) for noise in (case.state.noise.cart_m, case.state.noise.pole_rad)
    )
    coupling = theta[COUPLING]
    pair = (
        (theta[MASS] * cart, coupling * pole)
        if equation == FORCE
        else (theta[INERTIA] * pole, coupling * cart)
    )
    return float(np.hypot(*pair))


def _choose_rows(case: Case, theta: Floats, weights: Floats, equation: int) -> Ints:
    """Return where a filter is taken: inside stretches, on valid samples, joint not at rest."""
    signals, reach = case.signals, len(weights) // 2
    bad = _find_uncounted(case, theta, equation).astype(np.float64)
    stride = max(reach // 2, 1, -(-len(signals) // MOST_ROWS))
    inside = [
        np.arange(s.start + reach + EDGE, s.stop - reach - EDGE, stride) for s in signals.stretches
    ]
    at = np.concatenate(inside).astype(np.int64)
    return at[Sieve(weights, at)(bad) <= decisions.SIEVE_REST_SHARE] if len(at) else at


def _find_uncounted(case: Case, theta: Floats, equation: int) -> Mask:
    signals = case.signals
    rates = undo_sensors(case.state.states[None], theta[None], signals.clock_s)[0][:, 2 + equation]
    bad = np.abs(rates) < STANDING_SPEED_SHARE * np.sqrt(np.mean(rates**2))
    if signals.cart is not None:
        bad |= ~signals.cart_valid
    if signals.pole is not None:
        bad |= ~signals.pole_valid
    return bad
