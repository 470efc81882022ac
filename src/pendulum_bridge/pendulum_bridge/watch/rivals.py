"""Which change it was: each tried at its full size on the windows since it began.

The bank's scores are linear, and a doubled friction is no small change: sticking is not linear at
all. So before an alarm is given a name, each signature is fitted by running the twin with it, and
the fits are compared.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pendulum_bridge.watch.baseline import Baseline
from pendulum_bridge.watch.evidence import Leader
from pendulum_bridge.watch.noise import Weighed, scores, weighed
from pendulum_bridge.watch.reading import Reader, Reading
from pendulum_bridge.watch.signatures import Signature
from pendulum_bridge.watch.stream import History
from pendulum_twin.arrays import Floats
from pendulum_twin.effects.effect import Place

FIRST_SIZES = (
    -8.0,
    -4.0,
    -2.0,
    2.0,
    3.0,
    5.0,
    8.0,
    12.0,
)  # times what is worth an alarm, beside the linear size
LARGEST = 30.0  # times what is worth an alarm
FEW = 3  # windows on which they are tried
FINALISTS = 4  # signatures that are fitted in earnest
MOST_A_WINDOW = 1.5  # of log-likelihood, by which a window may speak for one rival against another
STEPS = 3  # of Gauss and Newton, at most, for each of them
IMPOSSIBLE = 1e9  # negative log-likelihood
HEAVY = 5.0  # degrees of freedom of the scatter of a window


@dataclass(frozen=True)
class Rival:
    """Hold one signature fitted to the windows: its number in the bank, size and deviation in its unit.

    windows: negative logarithm of each window's likelihood. misfit: mean weighed square of a row;
    1 when all is explained.
    next_size: where the fit would go on.
    """

    number: int
    size: float
    deviation: float
    windows: tuple[float, ...]
    misfit: float
    next_size: float

    @property
    def unlikely(self) -> float:
        """Return the negative logarithm of the likelihood of all windows."""
        return sum(self.windows)


def rivals(
    reader: Reader,
    bank: Sequence[Signature],
    baseline: Baseline,
    leaders: Sequence[Leader],
    windows: Sequence[History],
) -> list[Rival]:
    """Return the likeliest signatures, each fitted to the windows, the likeliest first.

    windows: at least one, each of which can be read with the twin as it is.
    """
    roughly = _sketches(reader, bank, baseline, leaders, windows[:: max(1, len(windows) // FEW)])
    order = sorted(range(len(bank)), key=lambda k: roughly[k][1])[:FINALISTS]
    fitted = [_fitted(_Trial(reader, bank[k], k, baseline, windows), roughly[k][0]) for k in order]
    return [fitted[k] for k in np.argsort(regrets(fitted), kind="stable")]


def gained(
    reader: Reader,
    bank: Sequence[Signature],
    baseline: Baseline,
    best: Rival,
    windows: Sequence[History],
) -> Floats:
    """Return by how much likelier each window is with a change than with the twin as it is, (windows,)."""
    without = _Trial(reader, bank[best.number], best.number, baseline, windows).at(0.0)
    return np.array(without.windows) - np.array(best.windows)


def confidences(bank: Sequence[Signature], fitted: Sequence[Rival]) -> Mapping[Place, float]:
    """Return each place's share of the likelihood among the rivals, as far as one may believe single windows."""
    shares: dict[Place, float] = {}
    for one, regret in zip(fitted, regrets(fitted), strict=True):
        place = bank[one.number].place
        shares[place] = shares.get(place, 0.0) + math.exp(-regret)
    total = sum(shares.values())
    return {place: share / total for place, share in shares.items()}


def regrets(fitted: Sequence[Rival]) -> Floats:
    """Return by how much each rival is less likely than the best one of each window, (rivals,), capped in each window.

    A single window must not decide: where a cart just sticks, a hundredth of a newton makes all
    the difference.
    """
    windows = np.array([one.windows for one in fitted])
    return np.sum(np.minimum(windows - windows.min(axis=0), MOST_A_WINDOW), axis=1)


@dataclass(frozen=True)
class _Trial:
    """Try one signature in several sizes on the same windows."""

    reader: Reader
    signature: Signature
    number: int
    baseline: Baseline
    windows: Sequence[History]

    def at(self, size: float) -> Rival:
        """Return how a size explains the windows, and the next size by one step of Gauss and Newton."""
        size = max(size, self.signature.least)
        changed, score, information, misfit, rows = (
            self.reader.changed(self.signature, size),
            0.0,
            1e-300,
            0.0,
            0,
        )
        unlikely = []
        for history in self.windows:
            reading = changed.read(history, self.baseline.noise.sensor)
            if reading is None:  # no run of such a twin ends
                unlikely.append(IMPOSSIBLE)
                continue
            window, n = (
                weighed(reading, self.baseline.noise, self.baseline.sizes),
                len(reading.off),
            )
            slopes, curvatures = scores(reading, window)
            weight = (HEAVY + n) / (HEAVY + window.misfit)
            score += weight * float(slopes[self.number])
            information += weight * float(curvatures[self.number, self.number])
            unlikely.append(_unlikely(window))
            misfit, rows = misfit + window.misfit, rows + n
        next_size = size + score / information
        return Rival(
            self.number, size, information**-0.5, tuple(unlikely), misfit / max(rows, 1), next_size
        )


def _sketches(
    reader: Reader,
    bank: Sequence[Signature],
    baseline: Baseline,
    leaders: Sequence[Leader],
    windows: Sequence[History],
) -> list[tuple[float, float]]:
    """Return for each signature the size that explains a few windows best, in rough, and how unlikely they are with it.

    The linear size may be wrong even in its sign: with more friction a cart sticks, and what
    sticks has no slope. So some plain sizes are tried beside it.
    """
    sizes = np.array(
        [
            [leader.size, *(f * each.worth for f in FIRST_SIZES)]
            for each, leader in zip(bank, leaders, strict=True)
        ]
    )
    sizes = np.clip(
        sizes, *np.array([[each.least, each.worth * LARGEST] for each in bank]).T[:, :, None]
    )
    theta = np.array(
        [reader.theta(each, size) for each, row in zip(bank, sizes, strict=True) for size in row]
    )
    total = np.zeros(sizes.size)
    for history in windows:
        reading = reader.read(history, baseline.noise.sensor)
        if reading is not None:
            sketched = reader.sketched(history, reading, baseline.noise.sensor, theta)
            total += np.array([_unlikely(_weighed(each, baseline)) for each in sketched])
    total = total.reshape(sizes.shape)
    best = np.argmin(total, axis=1)
    return [
        (float(row[k]), float(much[k])) for row, much, k in zip(sizes, total, best, strict=True)
    ]


def _weighed(reading: Reading | None, baseline: Baseline) -> Weighed | None:
    return None if reading is None else weighed(reading, baseline.noise, baseline.sizes)


def _unlikely(window: Weighed | None) -> float:
    """Return the negative logarithm of a window's likelihood, heavy-tailed from window to window; None for no run at all."""
    if window is None:
        return IMPOSSIBLE
    n = len(window.off)
    return 0.5 * (window.spread + (HEAVY + n) * math.log1p(max(window.misfit, 0.0) / HEAVY))


def _fitted(trial: _Trial, size: float) -> Rival:
    """Return the fit from a first size, by steps once or thrice as far: along friction they come out too short."""
    rival = trial.at(size)
    for _ in range(STEPS):
        step = rival.next_size - rival.size
        further = min(
            (trial.at(rival.size + each * step) for each in (1.0, 3.0)),
            key=lambda one: one.unlikely,
        )
        if further.unlikely >= rival.unlikely:
            break
        rival = further
    return rival
