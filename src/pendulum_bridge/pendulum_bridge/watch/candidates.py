"""Which change it was: candidates fitted at their full size on the windows since it began.

The bank's scores are linear, and a doubled friction is no small change: sticking is not linear at
all. So before an alarm gets a name, each signature is fitted by running the twin with it, and the
fits are compared.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pendulum_bridge.watch.baseline import Baseline
from pendulum_bridge.watch.evidence import Leader
from pendulum_bridge.watch.noise import WeighedWindow, compute_scores, weigh
from pendulum_bridge.watch.reading import Reader, Reading
from pendulum_bridge.watch.signatures import Signature
from pendulum_bridge.watch.stream import History
from pendulum_twin.arrays import Floats
from pendulum_twin.effects.effect import Place

# Sizes to try beside the linear size, in units of what is worth an alarm.
FIRST_SIZES = (-8.0, -4.0, -2.0, 2.0, 3.0, 5.0, 8.0, 12.0)
LARGEST_SIZE = 30.0  # in units of what is worth an alarm
SKETCH_WINDOWS = 3  # on which the first sizes are tried
FINALISTS = 4  # signatures that are fitted
MOST_REGRET_A_WINDOW = 1.5  # log-likelihood by which a window may speak against a candidate
GAUSS_NEWTON_STEPS = 3  # at most
STEP_FACTORS = (1.0, 3.0)  # along friction the steps of Gauss and Newton are too short
IMPOSSIBLE_UNLIKELIHOOD = 1e9  # of a twin that runs away
WINDOW_DEGREES_OF_FREEDOM = 5.0  # of a window's scatter: Student's t


@dataclass(frozen=True)
class Candidate:
    """Hold a signature fitted to the windows.

    number: in the bank.
    size, deviation: in the signature's unit; the fit and its standard deviation.
    windows: negative log-likelihood of each window.
    misfit: mean weighed square of a row; 1 when everything is explained.
    next_size: where the fit would go on.
    """

    number: int
    size: float
    deviation: float
    windows: tuple[float, ...]
    misfit: float
    next_size: float

    @property
    def unlikelihood(self) -> float:
        """Return the negative log-likelihood of all windows."""
        return sum(self.windows)


def fit_candidates(
    reader: Reader,
    bank: Sequence[Signature],
    baseline: Baseline,
    leaders: Sequence[Leader],
    windows: Sequence[History],
) -> list[Candidate]:
    """Return the likeliest signatures, fitted to the windows, the likeliest first.

    leaders: how each signature of the bank stands.
    windows: at least one, all readable with the twin as it is.
    """
    few = windows[:: max(1, len(windows) // SKETCH_WINDOWS)]
    sketches = _sketch(reader, bank, baseline, leaders, few)
    order = sorted(range(len(bank)), key=lambda k: sketches[k][1])[:FINALISTS]
    candidates = [
        _fit(_Trial(reader, bank[k], k, baseline, windows), sketches[k][0]) for k in order
    ]
    return [candidates[k] for k in np.argsort(compute_regrets(candidates), kind="stable")]


def compute_gains(
    reader: Reader,
    bank: Sequence[Signature],
    baseline: Baseline,
    best: Candidate,
    windows: Sequence[History],
) -> Floats:
    """Return the log-likelihood that each window gains by a change, (windows,)."""
    trial = _Trial(reader, bank[best.number], best.number, baseline, windows)
    return np.array(trial.evaluate(0.0).windows) - np.array(best.windows)


def compute_confidences(
    bank: Sequence[Signature], candidates: Sequence[Candidate]
) -> Mapping[Place, float]:
    """Return each place's share of the likelihood, each window's part being limited."""
    shares: dict[Place, float] = {}
    for candidate, regret in zip(candidates, compute_regrets(candidates), strict=True):
        place = bank[candidate.number].place
        shares[place] = shares.get(place, 0.0) + math.exp(-regret)
    total = sum(shares.values())
    return {place: share / total for place, share in shares.items()}


def compute_regrets(candidates: Sequence[Candidate]) -> Floats:
    """Return by how much each candidate is less likely than each window's best, (candidates,).

    A window's part is limited, for a single window must not decide: where a cart just sticks, a
    hundredth of a newton makes all the difference.
    """
    windows = np.array([candidate.windows for candidate in candidates])
    return np.sum(np.minimum(windows - windows.min(axis=0), MOST_REGRET_A_WINDOW), axis=1)


@dataclass(frozen=True)
class _Trial:
    """Try a signature, `number` in the bank, in several sizes on the same windows."""

    reader: Reader
    signature: Signature
    number: int
    baseline: Baseline
    windows: Sequence[History]

    def evaluate(self, size: float) -> Candidate:
        """Return how a size explains the windows, and the next size by Gauss and Newton."""
        size = max(size, self.signature.least)
        changed = self.reader.make_changed(self.signature, size)
        score, information, misfit, rows = 0.0, 1e-300, 0.0, 0
        unlikelihoods = []
        for history in self.windows:
            reading = changed.read(history, self.baseline.noise.sensor)
            if reading is None:  # such a twin runs away
                unlikelihoods.append(IMPOSSIBLE_UNLIKELIHOOD)
                continue
            window, n = _weigh(reading, self.baseline), len(reading.off)
            slopes, curvatures = compute_scores(reading, window)
            weight = (WINDOW_DEGREES_OF_FREEDOM + n) / (WINDOW_DEGREES_OF_FREEDOM + window.misfit)
            score += weight * float(slopes[self.number])
            information += weight * float(curvatures[self.number, self.number])
            unlikelihoods.append(_compute_unlikelihood(window))
            misfit, rows = misfit + window.misfit, rows + n
        return Candidate(
            self.number,
            size,
            information**-0.5,
            tuple(unlikelihoods),
            misfit / max(rows, 1),
            size + score / information,
        )


def _sketch(
    reader: Reader,
    bank: Sequence[Signature],
    baseline: Baseline,
    leaders: Sequence[Leader],
    windows: Sequence[History],
) -> list[tuple[float, float]]:
    """Return for each signature the best of some sizes, roughly, and its unlikelihood.

    The linear size may be wrong even in its sign: with more friction a cart sticks, and a cart
    that sticks has no slope. So plain sizes are tried beside it.
    """
    sizes = np.array(
        [
            [leader.size, *(factor * signature.worth for factor in FIRST_SIZES)]
            for signature, leader in zip(bank, leaders, strict=True)
        ]
    )
    bounds = np.array([[s.least, s.worth * LARGEST_SIZE] for s in bank])
    sizes = np.clip(sizes, *bounds.T[:, :, None])
    theta = np.array(
        [
            reader.compute_theta(signature, size)
            for signature, row in zip(bank, sizes, strict=True)
            for size in row
        ]
    )
    total = np.zeros(sizes.size)
    for history in windows:
        reading = reader.read(history, baseline.noise.sensor)
        if reading is not None:
            total += [
                IMPOSSIBLE_UNLIKELIHOOD
                if sketch is None
                else _compute_unlikelihood(_weigh(sketch, baseline))
                for sketch in reader.sketch(history, reading, baseline.noise.sensor, theta)
            ]
    unlikelihoods = total.reshape(sizes.shape)
    best = np.argmin(unlikelihoods, axis=1)
    numbers = np.arange(len(bank))
    return list(
        zip(sizes[numbers, best].tolist(), unlikelihoods[numbers, best].tolist(), strict=True)
    )


def _weigh(reading: Reading, baseline: Baseline) -> WeighedWindow:
    return weigh(reading, baseline.noise, baseline.sizes)


def _compute_unlikelihood(window: WeighedWindow) -> float:
    """Return a window's negative log-likelihood; windows scatter as Student's t."""
    freedom, n = WINDOW_DEGREES_OF_FREEDOM, len(window.off)
    scatter = (freedom + n) * math.log1p(max(window.misfit, 0.0) / freedom)
    return 0.5 * (window.spread + scatter)


def _fit(trial: _Trial, size: float) -> Candidate:
    """Return the fit from a first size."""
    candidate = trial.evaluate(size)
    for _ in range(GAUSS_NEWTON_STEPS):
        step = candidate.next_size - candidate.size
        further = min(
            (trial.evaluate(candidate.size + factor * step) for factor in STEP_FACTORS),
            key=lambda tried: tried.unlikelihood,
        )
        if further.unlikelihood >= candidate.unlikelihood:
            break
        candidate = further
    return candidate
