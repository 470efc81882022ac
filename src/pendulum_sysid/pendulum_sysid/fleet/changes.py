"""Find where the course of a size changes: steps, and where a drift begins.

The course is piecewise constant or linear. Its pieces are found by PELT (Killick, Fearnhead and
Eckley 2012) on the likelihood of the estimates with their standard errors. A change costs what
chance makes of a quiet history in FALSE_CHANGE_SHARE of all cases (Bonferroni over its recordings
and over all sizes that are asked about). A change must also stand out from the same estimates in
shuffled orders, which no wrong standard error can fool.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
import ruptures
from ruptures.base import BaseCost
from scipy.stats import chi2
from scipy.stats import t as student

from pendulum_sysid import decisions
from pendulum_twin.arrays import Floats

NEIGHBOURS = 5  # values, over which the running median goes
FEWEST_DEGREES = 5.0  # of freedom, of the scatter's estimate
COVERED = 0.95  # of the times within which a change lies
LEAST_FACTOR = 0.1  # of standard errors: values that do not differ at all are no measurement
BISECTIONS = 60
TINY = 1e-12
SHUFFLES = 1999  # orders, beside the true order


@dataclass(frozen=True)
class Piece:
    """Hold a piece of the course.

    Attributes:
        begin, end: first index, and one beyond the last.
        level: value at the piece's middle time.
        slope: a second; 0 for a constant piece.
        middle_s: s; the middle time.
        error, slope_error: standard errors.
    """

    begin: int
    end: int
    level: float
    slope: float
    middle_s: float
    error: float
    slope_error: float

    def predict(self, time_s: float) -> float:
        """Return the value of the course at a time."""
        return self.level + self.slope * (time_s - self.middle_s)


@dataclass(frozen=True)
class Change:
    """Hold one change.

    Attributes:
        index: of the first recording after the change.
        earliest, latest: the change lies after recording `earliest` and not after recording
            `latest`, with 95 % probability.
        drifts: True where a drift begins instead of a step.
        before, after: values on both sides; of a drift, at its beginning and at its end.
        chance: expected number of quiet histories of this kind that show as much, at most 1.
    """

    index: int
    earliest: int
    latest: int
    drifts: bool
    before: float
    after: float
    chance: float


@dataclass(frozen=True)
class Course:
    """Hold the pieces of a size's course in time, the changes between them, and the scatter.

    factor: of the standard errors, at most 1: smaller where neighbours differ by less.
    spread: standard deviation of the true values from recording to recording.
    drift_chance: as `Change.chance`, of a drift through all of the history; 1 for none.
    """

    pieces: tuple[Piece, ...]
    changes: tuple[Change, ...]
    factor: float
    spread: float
    drift_chance: float = 1.0


class _Likelihood(BaseCost):  # type: ignore[misc]
    """The cost of a piece: weighted squares about its mean, or about a line that costs more."""

    model = "piecewise constant or linear"
    min_size = 1

    def __init__(self, times: Floats, values: Floats, errors: Floats, slope_cost: float) -> None:
        self._slope_cost = slope_cost
        t = (times - times.mean()) / (float(np.ptp(times)) or 1.0)
        y = values - values.mean()
        w = errors**-2.0
        columns = (w, w * t, w * t * t, w * y, w * t * y, w * y * y)
        self._sums = np.vstack([np.zeros(6), np.cumsum(np.column_stack(columns), axis=0)])

    def fit(self, signal: Any) -> _Likelihood:
        self.signal = signal
        return self

    def error(self, start: int, end: int) -> float:
        return min(self.constant(start, end), self.linear(start, end) + self._slope_cost)

    def constant(self, start: int, end: int) -> float:
        w, _, _, wy, _, wyy = self._sums[end] - self._sums[start]
        return float(wyy - wy * wy / w)

    def linear(self, start: int, end: int) -> float:
        w, wt, wtt, wy, wty, _ = self._sums[end] - self._sums[start]
        spread = wtt - wt * wt / w
        bend = wty - wt * wy / w
        gain = bend * bend / spread if spread > 1e-9 * wtt else 0.0
        return self.constant(start, end) - float(gain)


def find_changes(
    times_s: Floats, values: Floats, errors: Floats, sizes_asked: int, may_drift: bool = True
) -> Course:
    """Return the course of a size, with its changes.

    times_s: (n,) s, rising.
    values: (n,) estimates.
    errors: (n,) their standard errors, above 0.
    sizes_asked: how many sizes of the rig are asked about alike.
    may_drift: False for what can only be there or not: outliers are not drawn in, nor is scatter
        beyond the standard errors believed.
    """
    n = len(values)
    factor, spread = measure_scatter(values, errors) if may_drift else (1.0, 0.0)
    scatter = np.hypot(factor * errors, spread)
    drawn = draw_in_outliers(values, scatter) if may_drift else values
    degrees = max(n / 2.0, FEWEST_DEGREES)
    chance = decisions.FALSE_CHANGE_SHARE / sizes_asked
    slope_cost = _square_quantile(chance / n, degrees) if may_drift else np.inf
    cost = _Likelihood(times_s, drawn, scatter, slope_cost)
    ends = [n]
    if n >= decisions.LEAST_HISTORY:
        search = ruptures.Pelt(custom_cost=cost, min_size=decisions.LEAST_SEGMENT, jump=1)
        ends = search.fit(drawn).predict(pen=_square_quantile(chance / n, degrees))
    ends, shuffled = _confirm(drawn, scatter, ends)
    alone = cost.constant(0, n) - cost.linear(0, n)
    confirmed_drift = _compare_with_shuffled(drawn, scatter) if len(ends) == 1 else 1.0
    if confirmed_drift > decisions.CONFIRMED_SHARE and len(ends) == 1:
        slope_cost = np.inf
    bounds = list(zip([0, *ends[:-1]], ends, strict=True))
    pieces = [_fit_piece(times_s, drawn, scatter, cost, slope_cost, *b) for b in bounds]
    questions = sizes_asked * n
    changes = [
        _describe_change(times_s, drawn, scatter, cost, pair, questions, degrees)
        for pair in pairwise(pieces)
    ]
    changes = [
        replace(change, chance=min(1.0, max(change.chance, share * sizes_asked)))
        for change, share in zip(changes, shuffled, strict=True)
    ]
    drift_chance = 1.0
    if len(pieces) == 1 and pieces[0].slope:
        drift_chance = _compute_chance(alone, sizes_asked, degrees)
        drift_chance = min(1.0, max(drift_chance, confirmed_drift * sizes_asked))
    return Course(tuple(pieces), tuple(changes), factor, spread, drift_chance)


def _confirm(values: Floats, scatter: Floats, ends: list[int]) -> tuple[list[int], list[float]]:
    """Return the ends of pieces whose changes stand out from shuffled orders, and these shares.

    The least certain change goes first; its neighbours are then asked again.
    """
    ends = list(ends)
    while True:
        edges = [0, *ends]
        shares = [
            _compare_with_shuffled(values[begin:end], scatter[begin:end])
            for begin, end in zip(edges[:-2], edges[2:], strict=True)
        ]
        if not shares or max(shares) <= decisions.CONFIRMED_SHARE:
            return ends, shares
        del ends[int(np.argmax(shares))]


def _compare_with_shuffled(values: Floats, scatter: Floats) -> float:
    """Return the share of shuffled orders in which a step takes away as much as in the true."""
    orders = np.random.default_rng(0).permuted(
        np.tile(np.arange(len(values)), (SHUFFLES + 1, 1)), axis=1
    )
    orders[0] = np.arange(len(values))
    weights, products = scatter**-2.0, values * scatter**-2.0
    w, wy = (np.cumsum(each[orders], axis=1) for each in (weights, products))
    least = min(decisions.LEAST_SEGMENT, (len(values) - 1) // 2)
    inner = slice(least - 1, len(values) - least)
    before, total = w[:, inner], w[:, -1:]
    after = np.maximum(total - before, TINY * total)  # a difference of sums may round to 0
    step = (wy[:, inner] / before - (wy[:, -1:] - wy[:, inner]) / after) ** 2
    gains = (step * before * after).max(axis=1)
    return float(np.mean(gains >= gains[0] * (1.0 - 1e-12)))


def measure_scatter(values: Floats, errors: Floats) -> tuple[float, float]:
    """Return the factor of the standard errors, at most 1, and the scatter beyond them.

    Both are read off the differences of neighbours, by their median: changes and drifts hardly
    touch it. Intervals of a short recording that a wrong model was fitted to are too wide: then
    their ratios alone are believed (as Birge's ratio does).
    """
    if len(values) < decisions.LEAST_HISTORY:
        return 1.0, 0.0
    differences = np.diff(values) ** 2
    own = errors[:-1] ** 2 + errors[1:] ** 2
    middle = float(chi2.median(1))
    ratio = float(np.median(differences / own)) / middle
    if ratio <= 1.0:
        return max(float(np.sqrt(ratio)), LEAST_FACTOR), 0.0
    low, high = 0.0, float(np.sqrt(differences.max() / middle))
    for _ in range(BISECTIONS):
        spread = 0.5 * (low + high)
        ratio = float(np.median(differences / (own + 2.0 * spread**2)))
        low, high = (spread, high) if ratio > middle else (low, spread)
    return 1.0, 0.5 * (low + high)


def draw_in_outliers(values: Floats, scatter: Floats) -> Floats:
    """Return the values, each at most HISTORY_OUTLIER deviations from its neighbours' median."""
    half = NEIGHBOURS // 2
    n = len(values)
    medians = np.array(
        [np.median(values[max(0, min(k - half, n - NEIGHBOURS)) :][:NEIGHBOURS]) for k in range(n)]
    )
    most = decisions.HISTORY_OUTLIER * scatter
    return np.clip(values, medians - most, medians + most)


def _square_quantile(chance: float, degrees: float) -> float:
    return float(student.isf(chance / 2.0, degrees)) ** 2


def _compute_chance(gain: float, questions: int, degrees: float) -> float:
    return float(min(1.0, questions * 2.0 * student.sf(np.sqrt(max(gain, 0.0)), degrees)))


def _fit_piece(
    times_s: Floats,
    values: Floats,
    scatter: Floats,
    cost: _Likelihood,
    slope_cost: float,
    begin: int,
    end: int,
) -> Piece:
    t, y, w = times_s[begin:end], values[begin:end], scatter[begin:end] ** -2.0
    middle = float(w @ t / w.sum())
    level, error = float(w @ y / w.sum()), float(w.sum() ** -0.5)
    slope, slope_error = 0.0, 0.0
    if cost.linear(begin, end) + slope_cost < cost.constant(begin, end):
        power = float(w @ (t - middle) ** 2)
        slope, slope_error = float(w @ ((t - middle) * y)) / power, power**-0.5
    return Piece(begin, end, level, slope, middle, error, slope_error)


def _describe_change(
    times_s: Floats,
    values: Floats,
    scatter: Floats,
    cost: _Likelihood,
    pair: tuple[Piece, Piece],
    questions: int,
    degrees: float,
) -> Change:
    """Return the change between two pieces: a step, or the beginning of a drift."""
    first, last = pair
    begin, end = first.begin, last.end
    least = decisions.LEAST_SEGMENT
    splits = list(range(begin + least, end - least + 1)) or [last.begin]
    costs = np.array([cost.error(begin, k) + cost.error(k, end) for k in splits])
    drifts = False
    if last.slope and not first.slope:
        hinges = np.array(
            [_fit_hinge(times_s, values, scatter, begin, end, k - 1) for k in splits]
        )
        jump = cost.constant(begin, last.begin) + cost.linear(last.begin, end)
        if hinges.min() <= jump + _square_quantile(decisions.FALSE_CHANGE_SHARE, degrees):
            drifts, costs = True, hinges
    alone = min(cost.constant(begin, end), cost.linear(begin, end))
    likely = np.exp(-0.5 * (costs - costs.min()))
    order = np.argsort(-likely)
    enough = np.searchsorted(np.cumsum(likely[order]) / likely.sum(), COVERED) + 1
    chosen = [splits[k] for k in order[:enough]]
    index = splits[int(np.argmin(costs))]
    edge = times_s[last.begin]
    before, after = first.predict(edge), last.predict(edge)
    if drifts:
        before, after = first.predict(times_s[index - 1]), last.predict(times_s[end - 1])
    gain = alone - float(costs.min())
    if not drifts:
        gain = alone - cost.constant(begin, index) - cost.constant(index, end)
        gain = max(gain, alone - cost.linear(begin, index) - cost.linear(index, end))
    return Change(
        index,
        min(chosen) - 1,
        max(chosen),
        drifts,
        before,
        after,
        _compute_chance(gain, questions, degrees),
    )


def _fit_hinge(
    times_s: Floats, values: Floats, scatter: Floats, begin: int, end: int, corner: int
) -> float:
    """Return the cost of a constant up to a corner and a line from there, without a jump."""
    t, y, s = times_s[begin:end], values[begin:end], scatter[begin:end]
    rows = np.column_stack([np.ones(len(t)), np.maximum(t - times_s[corner], 0.0)])
    rows[:, 1] /= float(np.ptp(times_s)) or 1.0
    solution = np.linalg.lstsq(rows / s[:, None], y / s, rcond=None)[0]
    return float(np.sum(((y - rows @ solution) / s) ** 2))


def count_changes(courses: Sequence[Course]) -> int:
    """Return how many changes and drifts courses show."""
    return sum(len(c.changes) + (c.drift_chance < 1.0) for c in courses)
