"""Fit waves to the force that the cart lacks: which period explains most, how large, what phase.

A run knows nothing of a period that is far off, so no small step leads to the right period. The
balance of the force judges every period at once.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from pendulum_sysid.finding.localisation.balance import Balance
from pendulum_twin.arrays import Floats
from pendulum_twin.effects.effect import Parameter

MOST_ROWS = 5000
WAVES = np.arange(2.0, 66.0, 0.25)  # over the travel, of a period along the rail
TRIED_AT_ONCE = 8  # columns: few enough to stay in the processor's cache
EVEN = 1e-9  # relative difference of wavenumbers' distances that counts as none

# wavenumbers (k,), their sines and cosines along a recording (n, k) -> (n, 2, k) force of a sine
# and of a cosine of amplitude 1, N
MakeColumns = Callable[[Floats, Floats, Floats], Floats]


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

    def make_columns(wavenumbers: Floats, sines: Floats, cosines: Floats) -> Floats:
        columns: Floats = factor[:, None, None] * np.stack([sines, cosines], axis=1)
        return columns

    return fit_waves(balance, values, make_columns, tried)


def fit_waves(balance: Balance, values: Floats, make_columns: MakeColumns, tried: Floats) -> Wave:
    """Return the wave whose columns explain most of a missing force, beside the twin's constants.

    values: (n,) over which it is a wave.
    tried: wavenumbers, rad per unit of the values; the first of those that explain most is taken.
    """
    rows = slice(None, None, -(-len(balance.lacking) // MOST_ROWS))
    own = np.linalg.qr(balance.turned[rows])[0]
    lacking = take_out(own, balance.lacking[rows])
    sieve = replace(balance.sieve, at=balance.sieve.at[rows])

    def filter_waves(wavenumbers: Floats, sines: Floats, cosines: Floats) -> Floats:
        """Return what the constants leave of waves, (rows, 2, k)."""
        return take_out(own, sieve(make_columns(wavenumbers, sines, cosines)))

    explained = [
        _compute_explained(filter_waves(wavenumbers, turns.imag, turns.real), lacking)
        for wavenumbers, turns in _turn_waves(values, tried)
    ]
    best = tried[int(np.argmax(np.concatenate(explained)))]
    phase = (best * values)[:, None]
    filtered = filter_waves(np.array([best]), np.sin(phase), np.cos(phase))[..., 0]
    sine, cosine = np.linalg.lstsq(filtered.T @ filtered, lacking @ filtered, rcond=None)[
        0
    ].tolist()
    return Wave(float(best), float(np.hypot(sine, cosine)), float(np.arctan2(cosine, sine)))


def _turn_waves(values: Floats, wavenumbers: Floats) -> Iterator[tuple[Floats, np.ndarray]]:
    """Yield some wavenumbers (k,) at a time, and exp(i wavenumber value) of them, (n, k).

    A sine costs ten times as much as a product: where wavenumbers are evenly spaced, each wave is
    the wave before times the same turn.
    """
    wave, turn, step = np.ones(len(values), dtype=np.complex128), values, np.nan
    block: list[np.ndarray] = []
    for k, further in enumerate(np.diff(wavenumbers, prepend=0.0).tolist()):
        if not math.isclose(further, step, rel_tol=EVEN):
            step, turn = further, np.exp(1j * further * values)
        wave = wave * turn
        block.append(wave)
        if len(block) == TRIED_AT_ONCE or k == len(wavenumbers) - 1:
            yield wavenumbers[k + 1 - len(block) : k + 1], np.stack(block, axis=1)
            block = []


def _compute_explained(filtered: Floats, lacking: Floats) -> Floats:
    """Return the power (k,) of a missing force (rows,) that each pair of columns explains.

    filtered: (rows, 2, k).
    """
    likeness = np.tensordot(lacking, filtered, axes=1).T
    normal = np.einsum("rik,rjk->kij", filtered, filtered)
    weights = np.linalg.pinv(normal, hermitian=True) @ likeness[..., None]
    explained: Floats = np.sum(likeness * weights[..., 0], axis=1)
    return explained


def take_out(basis: Floats, columns: Floats) -> Floats:
    """Return columns (rows, ...) without what an orthonormal basis (rows, k) explains."""
    shared = np.tensordot(basis, np.tensordot(basis.T, columns, axes=1), axes=1)
    rest: Floats = columns - shared
    return rest
