"""Least squares over many windows at once: common parameters, and a start state of each window's own.

Multiple shooting with the start states eliminated by a Schur complement (Bock, in Numerical Treatment of Inverse Problems
(1983); Golub and Pereyra, SIAM J. Numer. Anal. 10 (1973) 413). The variance of each channel is estimated along (the
concentrated likelihood), so that a channel whose model is still wrong does not outshout the other.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from pendulum_sysid.parameters import Free
from pendulum_sysid.records import Ints, Windows
from pendulum_sysid.windows import channels, gather
from pendulum_twin.signals import Floats, Signals
from pendulum_twin.simulate import drive_pass, driven_runs

STEP = 1e-4  # of a parameter's size, for differences
FAR = 1e6  # deviations: as wrong as a run may count that has left all bounds
CONVERGED = 1e-5  # relative gain of the likelihood a sample
AT_ONCE = 4_000_000  # numbers of runs that are held at one time, so that a long recording needs no more memory


@dataclass(frozen=True)
class Problem:
    """Hold the data of a fit: windows of a recording, and how far the smoothed starts may be off.

    deviations: (4,) of x, th, v, w; a start that leaves its smoothed value pays for it as for any other error.
    """

    signals: Signals
    windows: Windows
    deviations: Floats


@dataclass(frozen=True)
class Solution:
    """Hold a fit: words (SIZE,), start states (windows, 4), squared errors and counts (windows, channels).

    normal: (parameters, parameters) of the reduced problem; scores: (windows, parameters) each window's gradient.
    """

    words: Floats
    starts: Floats
    squares: Floats
    counts: Floats
    converged: bool = True
    normal: Floats | None = None
    scores: Floats | None = None

    @property
    def power(self) -> Floats:
        """Return each channel's mean squared error."""
        return _power(self.squares, self.counts)

    def misfit(self, noise: Floats) -> float:
        """Return the geometric mean over channels of root mean square error / noise."""
        return float(np.exp(0.5 * np.mean(np.log(self.power / noise**2))))


def _power(squares: Floats, counts: Floats) -> Floats:
    return np.maximum(squares.sum(axis=0) / np.maximum(counts.sum(axis=0), 1.0), 1e-30)


def _cost(problem: Problem, starts: Floats, squares: Floats, counts: Floats) -> float:
    """Return the concentrated negative log likelihood (of Gaussian errors, each channel's variance its best) a sample."""
    total = counts.sum(axis=0)
    if not np.all(np.isfinite(squares)):
        return np.inf
    varied = _varied(problem)
    moved = (starts - problem.windows.starts)[:, varied] / problem.deviations[varied]
    return float((np.sum(total * np.log(_power(squares, counts))) + np.sum(moved**2)) / (2 * total.sum()))


def _varied(problem: Problem) -> list[int]:
    present = channels(problem.signals)
    return [*present, *(k + 2 for k in present)]


def _errors(
    problem: Problem, drives: tuple[Floats, Ints], words: Floats, starts: Floats, set_of: np.ndarray, at: np.ndarray
) -> Floats:
    """Return measured minus run, (runs, samples, channels); `at` is the window of each run."""
    windows = problem.windows
    runs = driven_runs(problem.signals, drives, words, set_of, windows.begin[at], starts, windows.samples)
    measured, counts = gather(problem.signals, windows.begin, windows.samples)
    return (measured[at] - runs[..., list(channels(problem.signals))]) * counts[at]


def _squares(problem: Problem, words: Floats, starts: Floats) -> Floats:
    at = np.arange(len(starts))
    drives = drive_pass(problem.signals, words[None])
    errors = _errors(problem, drives, words[None], starts, np.zeros(len(at), dtype=np.int64), at)
    return np.sum(errors**2, axis=1)


def solve(
    problem: Problem, words: Floats, free: tuple[Free, ...], starts: Floats | None = None, iterations: int = 20
) -> Solution:
    """Return the fit of the free parameters and of the windows' start states, beginning at words.

    With no free parameters only the start states are fitted. Steps that do not improve are shortened (Levenberg-Marquardt);
    parameters stay within their bounds.
    """
    windows = problem.windows
    starts = windows.starts.copy() if starts is None else starts.copy()
    words = words.copy()
    _, weights = gather(problem.signals, windows.begin, windows.samples)
    counts = weights.sum(axis=1)
    squares = _squares(problem, words, starts)
    cost = _cost(problem, starts, squares, counts)
    damping, converged = 1e-6, False
    system = None
    for _ in range(iterations):
        system = linearised(problem, words, starts, free, _power(squares, counts))
        while True:
            new_words, new_starts = _stepped(system, words, starts, free, damping)
            new_squares = _squares(problem, new_words, new_starts)
            new_cost = _cost(problem, new_starts, new_squares, counts)
            if new_cost < cost or damping > 1e4:
                break
            damping = max(damping * 10, 1e-3)
        if not new_cost < cost:
            converged = True
            break
        gain, cost = cost - new_cost, new_cost
        words, starts, squares = new_words, new_starts, new_squares
        damping = max(damping * 0.1, 1e-9)
        if gain < CONVERGED:
            converged = True
            break
    if system is None:
        return Solution(words, starts, squares, counts, converged)
    return Solution(words, starts, squares, counts, converged, system.normal, system.scores)


@dataclass(frozen=True)
class System:
    """Hold the normal equations of columns with the start states eliminated, and what gives the starts back.

    Residuals are in units of each channel's deviation, columns change by a parameter's size (a start's deviation).
    normal: (columns, columns); scores: (windows, columns), each window's part of the gradient.
    """

    normal: Floats
    scores: Floats
    start_normal: Floats  # (windows, s, s)
    start_gradient: Floats  # (windows, s)
    cross: Floats  # (windows, s, columns)
    start_sizes: Floats
    varied: list[int]

    @property
    def gradient(self) -> Floats:
        """Return the gradient over all windows, (columns,)."""
        return self.scores.sum(axis=0)


def linearised(
    problem: Problem,
    words: Floats,
    starts: Floats,
    free: tuple[Free, ...],
    power: Floats,
    whole_steps: Floats | None = None,
) -> System:
    """Return the normal equations at words and starts, by differences.

    power: (channels,) each channel's mean squared error. whole_steps: (more, SIZE) further word vectors, each of which
    adds one column: what going all the way there changes.
    """
    more = np.empty((0, words.size)) if whole_steps is None else whole_steps
    sets, scale = _neighbours(words, free)
    sets = np.concatenate([sets, more])
    drives = drive_pass(problem.signals, sets)
    many = len(sets) + len(_varied(problem))
    size = max(AT_ONCE // (many * problem.windows.samples * starts.shape[1]), 1)
    parts = [np.arange(a, min(a + size, len(starts))) for a in range(0, len(starts), size)]
    systems = [_part_of_system(problem, drives, sets, scale, starts, power, part) for part in parts]

    def stack(name: str) -> Floats:
        return np.concatenate([getattr(one, name) for one in systems])

    return System(
        normal=np.sum([one.normal for one in systems], axis=0),
        scores=stack("scores"),
        start_normal=stack("start_normal"),
        start_gradient=stack("start_gradient"),
        cross=stack("cross"),
        start_sizes=systems[0].start_sizes,
        varied=systems[0].varied,
    )


def _part_of_system(
    problem: Problem,
    drives: tuple[Floats, Ints],
    sets: Floats,
    scale: Floats,
    starts: Floats,
    power: Floats,
    chosen: Ints,
) -> System:
    """Return the normal equations of the chosen windows; sets: words, their neighbours (scale of each), whole steps."""
    varied = _varied(problem)
    sizes = problem.deviations[varied]
    count, many = len(chosen), len(sets) + len(varied)
    set_of = np.repeat(np.array([*range(len(sets)), *([0] * len(varied))]), count)
    runs = np.tile(starts[chosen], (many, 1, 1))
    for k, index in enumerate(varied):
        runs[len(sets) + k, :, index] += sizes[k]
    off_by = _errors(problem, drives, sets, runs.reshape(-1, 4), set_of, np.tile(chosen, many)) / np.sqrt(power)
    errors = np.nan_to_num(off_by, nan=FAR, posinf=FAR, neginf=-FAR).clip(-FAR, FAR).reshape(many, count, -1)
    base = errors[0]
    change = base - errors[1:]
    change[: len(scale)] *= scale[:, None, None]
    by_column = np.moveaxis(change[: len(sets) - 1], 0, 2)
    by_start = np.moveaxis(change[len(sets) - 1 :], 0, 2)
    start_normal = by_start.transpose(0, 2, 1) @ by_start
    start_normal += np.eye(len(varied))  # the smoothed start is a measurement, too
    off = (problem.windows.starts - starts)[chosen][:, varied] / sizes
    start_gradient = (by_start.transpose(0, 2, 1) @ base[..., None])[..., 0] + off
    cross = by_start.transpose(0, 2, 1) @ by_column
    moved = np.linalg.solve(start_normal, cross)  # how the best start follows the parameters
    scores = (by_column.transpose(0, 2, 1) @ base[..., None])[..., 0]
    scores -= (moved.transpose(0, 2, 1) @ start_gradient[..., None])[..., 0]
    normal = np.tensordot(by_column, by_column, ((0, 1), (0, 1))) - np.tensordot(cross, moved, ((0, 1), (0, 1)))
    return System(normal, scores, start_normal, start_gradient, cross, sizes, varied)


def _neighbours(words: Floats, free: tuple[Free, ...]) -> tuple[Floats, Floats]:
    """Return words and their neighbours one small step along each parameter, and size / step of each."""
    sets = np.repeat(words[None], 1 + len(free), axis=0)
    scale = np.empty(len(free))
    for k, one in enumerate(free):
        value = one.get(words)
        step = STEP * one.size
        step = step if value + step <= one.high else -step
        one.put(sets[k + 1], value + step)
        scale[k] = one.size / step
    return sets, scale


def _stepped(system: System, words: Floats, starts: Floats, free: tuple[Free, ...], damping: float) -> tuple[Floats, Floats]:
    """Return words and starts after one damped step; a parameter that would leave its range stops at its bound."""
    values = np.array([one.get(words) for one in free])
    sizes = np.array([one.size for one in free])
    low, high = np.array([one.low for one in free]), np.array([one.high for one in free])
    step = np.zeros(len(free))
    loose = np.ones(len(free), dtype=bool)
    for _ in range(len(free)):
        normal = system.normal[np.ix_(loose, loose)]
        diagonal = np.diag(normal) + 1e-12
        rest = system.gradient[loose] - system.normal[np.ix_(loose, ~loose)] @ step[~loose]
        step[loose] = np.linalg.lstsq(normal + damping * np.diag(diagonal), rest, rcond=1e-13)[0]
        reached = values + step * sizes
        out = loose & ((reached < low) | (reached > high))
        if not out.any():
            break
        step[out] = (np.clip(reached, low, high) - values)[out] / sizes[out]
        loose &= ~out
        if not loose.any():
            break
    new_words = words.copy()
    for one, value, change in zip(free, values, step * sizes, strict=True):
        one.put(new_words, float(np.clip(value + change, one.low, one.high)))
    rest = system.start_gradient - system.cross @ step
    moves = np.linalg.solve(system.start_normal, rest[..., None])[..., 0]
    new_starts = starts.copy()
    new_starts[:, system.varied] += moves * system.start_sizes
    return new_words, new_starts


def half_widths(solution: Solution, free: tuple[Free, ...], together: int = 1) -> Floats:
    """Return the half widths of 95 % intervals, (parameters,), infinite where the data fix nothing.

    together: how many windows in a row are parts of one. The windows' gradients are taken as independent, their scatter
    as it is: a sandwich clustered by window with its usual correction for few clusters (Cameron and Miller, J. Human
    Resources 50 (2015) 317, section VI), which stays honest when the model is wrong; the classical width is the least.
    """
    if not free:
        return np.empty(0)
    assert solution.normal is not None and solution.scores is not None
    scores = solution.scores.reshape(-1, together, len(free)).sum(axis=1)
    count = len(scores)
    values, vectors = np.linalg.eigh(solution.normal)
    blind = values < 1e-10 * max(values.max(), 1e-300)
    inverse = (vectors / np.where(blind, np.inf, values)) @ vectors.T
    spread = inverse @ (scores.T @ scores) @ inverse * count / max(count - 1, 1)
    variance = np.maximum(np.diag(spread), np.diag(inverse))
    variance = np.where((vectors**2 @ blind) > 1e-6, np.inf, variance)
    return student.ppf(0.975, max(count - 1, 1)) * np.sqrt(variance) * np.array([one.size for one in free])


def refined(problem: Problem, words: Floats, starts: Floats | None = None) -> Solution:
    """Return the best start states for a twin that is not to be changed: how well it can run at all."""
    return solve(problem, words, (), starts, iterations=4)
