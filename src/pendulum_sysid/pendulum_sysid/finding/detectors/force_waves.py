"""Fit waves to the force that the cart lacks: which period explains most, how large, what phase.

A run knows nothing of a period that is far off, so no small step leads to the right period. The
balance of the force judges every period at once.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from pendulum_sysid.finding.localisation.balance import Balance
from pendulum_twin.arrays import Floats
from pendulum_twin.effects.effect import Parameter

MOST_ROWS = 5000
WAVES = np.arange(2.0, 66.0, 0.25)  # over the travel, of a period along the rail


@dataclass(frozen=True)
class Wave:
    """Hold a wave factor * amplitude * sin(wavenumber * value + phase).

    wavenumber: rad per unit of the values.
    amplitude: in the unit for which `make_columns` returns N.
    phase: rad.
    """

    wavenumber: float
    amplitude: float
    phase: float


def list_wavenumbers(travel: float, period: Parameter) -> Floats:
    """Return the wavenumbers, rad/m, that a cart's travel (m) can show and an effect can have.

    period: of the effect, m; at least one wavenumber is returned. A short travel would hold waves
        that are shorter than the effect's shortest.
    """
    inside = np.array([1.0, -1.0]) * 1e-9 + 1.0  # so that rounding leaves them within
    periods = np.clip(travel / WAVES, *(inside * [period.low, period.high]))
    return 2.0 * np.pi / np.unique(periods)[::-1]


def find_wave(balance: Balance, factor: Floats, values: Floats, tried: Floats) -> Wave:
    """Return the wave that explains most of a missing force, beside the twin's own constants.

    factor: (n,) along the recording, by which the wave is multiplied.
    values: (n,) over which it is a wave.
    tried: wavenumbers, rad per unit of the values.
    """

    def make_columns(wavenumber: float) -> Floats:
        phase = wavenumber * values
        columns: Floats = factor[:, None] * np.stack([np.sin(phase), np.cos(phase)], axis=1)
        return columns

    return fit_waves(balance, make_columns, tried)


def fit_waves(balance: Balance, make_columns: Callable[[float], Floats], tried: Floats) -> Wave:
    """Return the wave whose columns explain most of a missing force, beside the twin's constants.

    make_columns: wavenumber -> (n, 2) force of a sine and of a cosine of amplitude 1, N.
    tried: wavenumbers.
    """
    rows = slice(None, None, -(-len(balance.lacking) // MOST_ROWS))
    own = np.linalg.qr(balance.turned[rows])[0]
    lacking = take_out(own, balance.lacking[rows])
    sieve = replace(balance.sieve, at=balance.sieve.at[rows])
    best, gain = Wave(float(tried[0]), 0.0, 0.0), -1.0
    for wavenumber in tried.tolist():
        filtered = take_out(own, sieve(make_columns(wavenumber)))
        likeness = lacking @ filtered
        weights = np.linalg.lstsq(filtered.T @ filtered, likeness, rcond=None)[0]
        explained = float(likeness @ weights)
        if explained > gain:
            sine, cosine = weights.tolist()
            gain = explained
            best = Wave(wavenumber, float(np.hypot(sine, cosine)), float(np.arctan2(cosine, sine)))
    return best


def take_out(basis: Floats, columns: Floats) -> Floats:
    """Return columns (rows, ...) without what an orthonormal basis (rows, k) explains."""
    rest: Floats = columns - basis @ (basis.T @ columns)
    return rest
