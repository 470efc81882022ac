"""Normal equations of the free runs of windows in theta and in their own start states.

Derivatives are differences between runs of theta and its neighbours along every parameter. The
start states of the windows are eliminated by a Schur complement (Golub and Pereyra, SIAM J. Numer.
Anal. 10 (1973) 413): the remainder is in the parameters alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from pendulum_sysid.fitting.parameters import Free
from pendulum_sysid.fitting.windows import gather, list_channels
from pendulum_sysid.records import Windows
from pendulum_twin.arrays import Floats, Ints, Mask
from pendulum_twin.free_runs import count_substeps, run_drive, run_driven
from pendulum_twin.signals import Signals

STEP = 1e-4  # of a parameter's size, for differences
FAR = 1e6  # deviations: as wrong as a run may count that has left all bounds
RUNS_AT_ONCE = 4_000_000  # numbers of runs that are held at one time: bounds the memory
DRIVES_AT_ONCE = 32_000_000  # the same of what command and drive make of the whole recording


@dataclass(frozen=True)
class Problem:
    """Hold the data of a fit: windows of a recording, and how far the smoothed starts may be off.

    deviations: (4,) of x, th, v, w; a start that leaves its smoothed value pays for it as for any
        other error.
    step_s: s, the longest step of the runs; None for the twin's own.
    """

    signals: Signals
    windows: Windows
    deviations: Floats
    step_s: float | None = None


def list_varied(problem: Problem) -> list[int]:
    """Return the fitted entries of a start state: position and velocity of every channel."""
    present = list_channels(problem.signals)
    return [*present, *(k + 2 for k in present)]


def compute_errors(problem: Problem, theta: Floats, start_states: Floats) -> Floats:
    """Return measured minus run, (windows, samples, channels).

    theta: (SIZE,) of the twin.
    start_states: (windows, 4) x (m), th (rad), v (m/s), w (rad/s).
    """
    first = np.zeros(len(start_states), dtype=np.int64)
    return compute_errors_by_set(problem, theta[None], first, start_states)


def compute_errors_by_set(
    problem: Problem, theta: Floats, set_of: Ints, start_states: Floats
) -> Floats:
    """Return measured minus run, (windows, samples, channels), each window run by its own set.

    theta: (sets, SIZE) parameter vectors.
    set_of: (windows,) index of each window's set.
    start_states: (windows, 4) x (m), th (rad), v (m/s), w (rad/s).
    """
    drives = run_drive(problem.signals, theta, problem.step_s)
    every = np.arange(len(start_states))
    return _compute_errors_of_runs(problem, drives, theta, set_of, every, start_states)


def _compute_errors_of_runs(
    problem: Problem,
    drives: tuple[Floats, Ints],
    theta: Floats,
    set_of: Ints,
    window_of: Ints,
    start_states: Floats,
) -> Floats:
    """Return measured minus run, (runs, samples, channels).

    drives: what command and drive make of the recording, for each set (`run_drive`).
    theta: (sets, SIZE) parameter vectors.
    set_of, window_of: (runs,) indices of each run's set and window.
    start_states: (runs, 4) x (m), th (rad), v (m/s), w (rad/s).
    """
    signals, samples = problem.signals, problem.windows.samples
    begin = problem.windows.begin
    runs = run_driven(signals, drives, theta, set_of, begin[window_of], start_states, samples)
    measured, counts = gather(signals, begin, samples)
    errors: Floats = measured[window_of] - runs[..., list(list_channels(signals))]
    errors *= counts[window_of]
    return errors


@dataclass(frozen=True)
class System:
    """Hold normal equations with the start states eliminated, and what gives them back.

    Residuals are in units of each channel's deviation. A column is the change of the runs by a
    parameter's size. Of a start state s entries are fitted, at most 4.

    normals: (windows, columns, columns) each window's part of the matrix.
    scores: (windows, columns) each window's part of the gradient.
    start_normal: (windows, s, s) matrix of the start states.
    start_gradient: (windows, s) their gradient.
    cross: (windows, s, columns) products of start states and parameters.
    start_sizes: (s,) deviations by which the entries of a start state are changed.
    varied: (s,) these entries: 0 x, 1 th, 2 v, 3 w.
    beliefs, pulls: (columns,) weight of what is believed of a column's parameter beforehand, and
        how many sizes above the present value.
    """

    normals: Floats
    scores: Floats
    start_normal: Floats
    start_gradient: Floats
    cross: Floats
    start_sizes: Floats
    varied: list[int]
    beliefs: Floats | float = 0.0
    pulls: Floats | float = 0.0

    def pick(self, columns: Sequence[int]) -> System:
        """Return the system with these columns; the other parameters stay where they are."""
        count = self.normals.shape[1]
        return replace(
            self,
            normals=self.normals[:, columns][:, :, columns],
            scores=self.scores[:, columns],
            cross=self.cross[..., columns],
            beliefs=np.broadcast_to(self.beliefs, count)[columns],
            pulls=np.broadcast_to(self.pulls, count)[columns],
        )

    @cached_property
    def normal(self) -> Floats:
        """Return the matrix over all windows, (columns, columns), beliefs included."""
        columns = self.normals.shape[1]
        return self.normals.sum(axis=0) + np.diag(np.broadcast_to(self.beliefs, columns))

    @property
    def gradient(self) -> Floats:
        """Return the gradient over all windows, (columns,), beliefs included."""
        return self.scores.sum(axis=0) + self.beliefs * self.pulls


def linearise(
    problem: Problem,
    theta: Floats,
    start_states: Floats,
    free: tuple[Free, ...],
    power: Floats,
    whole_steps: Floats | None = None,
) -> System:
    """Compute the normal equations at theta and start states, by differences.

    power: (channels,) each channel's mean squared error, m^2 or rad^2.
    whole_steps: (more, SIZE) further parameter vectors. Each adds a column: the change of the runs
        from theta all the way to that vector.
    """
    more = np.empty((0, theta.size)) if whole_steps is None else whole_steps
    sets, scale = list_neighbours(theta, free)
    sets = np.concatenate([sets, more])
    many = len(sets) + len(list_varied(problem))
    size = max(RUNS_AT_ONCE // (many * problem.windows.samples * start_states.shape[1]), 1)
    pieces = [
        slice(a, min(a + size, len(start_states))) for a in range(0, len(start_states), size)
    ]
    acting = np.ones((len(sets), len(start_states)), dtype=bool)
    for row, parameter in zip(acting[1 : 1 + len(free)], free, strict=True):
        row[:] = _list_acting(problem.windows, parameter)
    off = _compute_all_errors(problem, sets, start_states, pieces, acting)
    off /= np.sqrt(power)
    systems = [_assemble_part(problem, off[:, part], scale, start_states, part) for part in pieces]

    def stack(name: str) -> Floats:
        return np.concatenate([getattr(system, name) for system in systems])

    return System(
        normals=stack("normals"),
        scores=stack("scores"),
        start_normal=stack("start_normal"),
        start_gradient=stack("start_gradient"),
        cross=stack("cross"),
        start_sizes=systems[0].start_sizes,
        varied=systems[0].varied,
        beliefs=np.array([*(p.belief for p in free), *[0.0] * len(more)]),
        pulls=np.array([*(p.compute_pull(theta) for p in free), *[0.0] * len(more)]),
    )


def _list_acting(windows: Windows, parameter: Free) -> Mask:
    """Return in which windows a parameter may act, (windows,)."""
    if parameter.acts is None:
        return np.ones(len(windows.begin), dtype=bool)
    so_far = np.concatenate([[0], np.cumsum(parameter.acts)])
    return so_far[windows.begin + windows.samples] > so_far[windows.begin]


def _compute_all_errors(
    problem: Problem, sets: Floats, start_states: Floats, pieces: list[slice], acting: Mask
) -> Floats:
    """Return measured minus run, (sets + starts that are varied, windows, samples, channels).

    First each parameter vector from the given starts, then the first set from starts one deviation
    off along each entry.

    acting: (sets, windows) where a set's runs differ from those of the first set; the others are
        not made.
    """
    varied = list_varied(problem)
    acting = np.concatenate([acting, np.ones((len(varied), len(start_states)), dtype=bool)])
    moves = np.zeros((len(sets) + len(varied), 4))
    moves[np.arange(len(sets), len(moves)), varied] = problem.deviations[varied]
    set_of = np.array([*range(len(sets)), *([0] * len(varied))])
    all_errors = np.empty(
        (
            len(moves),
            len(start_states),
            problem.windows.samples,
            len(list_channels(problem.signals)),
        )
    )
    for sharing in _list_groups(problem, len(sets)):
        drives = run_drive(problem.signals, sets[sharing], problem.step_s)
        lanes = np.flatnonzero(np.isin(set_of, sharing))
        for part in pieces:
            lane, window = np.nonzero(acting[lanes, part])
            lane, window = lanes[lane], window + part.start
            all_errors[lane, window] = _compute_errors_of_runs(
                problem,
                drives,
                sets[sharing],
                set_of[lane] - sharing[0],
                window,
                start_states[window] + moves[lane],
            )
    for errors, acts in zip(all_errors, acting, strict=True):
        errors[~acts] = all_errors[0, ~acts]
    return all_errors


def _list_groups(problem: Problem, sets: int) -> list[Ints]:
    """Return the sets in groups whose drives fit into memory together."""
    row = len(problem.signals) * count_substeps(problem.signals, problem.step_s)
    size = max(DRIVES_AT_ONCE // row, 1)
    return [np.arange(a, min(a + size, sets)) for a in range(0, sets, size)]


def _assemble_part(
    problem: Problem, off_by: Floats, scale: Floats, start_states: Floats, part: slice
) -> System:
    """Return the normal equations of a part of the windows.

    off_by: (sets + varied starts, windows, samples, channels) their errors, in units of each
        channel's deviation, in the order of `_compute_all_errors`.
    scale: (parameters,) size of each parameter over its step.
    part: the windows.
    """
    varied = list_varied(problem)
    sizes = problem.deviations[varied]
    count, sets = off_by.shape[1], len(off_by) - len(varied)
    errors = np.clip(off_by, -FAR, FAR).reshape(len(off_by), count, -1)
    if np.isnan(errors.sum()):
        errors[np.isnan(errors)] = FAR
    base = errors[0]
    change = base - errors[1:]
    change[: len(scale)] *= scale[:, None, None]
    by_column = np.moveaxis(change[: sets - 1], 0, 2)
    by_start = np.moveaxis(change[sets - 1 :], 0, 2)
    start_normal = by_start.transpose(0, 2, 1) @ by_start
    start_normal += np.eye(len(varied))  # the smoothed start is a measurement, too
    off = (problem.windows.start_states - start_states)[part][:, varied] / sizes
    start_gradient = (by_start.transpose(0, 2, 1) @ base[..., None])[..., 0] + off
    cross = by_start.transpose(0, 2, 1) @ by_column
    moved = np.linalg.solve(start_normal, cross)  # how the best start follows the parameters
    scores = (by_column.transpose(0, 2, 1) @ base[..., None])[..., 0]
    scores -= (moved.transpose(0, 2, 1) @ start_gradient[..., None])[..., 0]
    normals = by_column.transpose(0, 2, 1) @ by_column - cross.transpose(0, 2, 1) @ moved
    return System(normals, scores, start_normal, start_gradient, cross, sizes, varied)


def list_neighbours(theta: Floats, free: tuple[Free, ...]) -> tuple[Floats, Floats]:
    """Return theta and its neighbours along each parameter, and each parameter's size / step.

    Shapes (1 + parameters, SIZE) and (parameters,).
    """
    sets = np.repeat(theta[None], 1 + len(free), axis=0)
    scale = np.empty(len(free))
    for k, parameter in enumerate(free):
        value = parameter.get(theta)
        step = STEP * parameter.size
        step = step if value + step <= parameter.high else -step
        parameter.put(sets[k + 1], value + step)
        scale[k] = parameter.size / step
    return sets, scale
