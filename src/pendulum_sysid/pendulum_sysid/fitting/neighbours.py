"""Runs of a parameter vector and of its neighbours, by which derivatives are differences."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pendulum_sysid.fitting.parameters import JUMPS, Free
from pendulum_sysid.fitting.problem import Problem, compute_errors_of_runs, list_varied
from pendulum_sysid.fitting.windows import list_channels
from pendulum_sysid.records import Windows
from pendulum_twin.arrays import Floats, Ints, Mask
from pendulum_twin.free_runs import count_substeps, run_drive

STEP = 1e-4  # of a parameter's size, for differences
RUNS_AT_ONCE = 1_000_000  # numbers of runs at one time: memory is reused without page faults
DRIVES_AT_ONCE = 32_000_000  # the same of what command and drive make of the whole recording


@dataclass(frozen=True)
class NeighbourErrors:
    """Hold the errors of a parameter vector and of its neighbours, all from the same starts.

    off: (1 + columns + varied starts, windows, samples, channels) measured minus run, in units of
        each channel's deviation: of the vector itself, of each neighbour, and of the vector from
        starts that are moved.
    scale: (parameters,) size of each parameter over its step; of whole steps there is none.
    beliefs, pulls: (columns,) see `System`.
    """

    off: Floats
    scale: Floats
    beliefs: Floats
    pulls: Floats

    @property
    def columns(self) -> Floats:
        """Return the errors of the neighbours, (columns, windows, samples, channels)."""
        return self.off[1 : 1 + len(self.beliefs)]


def run_neighbours(
    problem: Problem,
    theta: Floats,
    start_states: Floats,
    free: tuple[Free, ...],
    power: Floats,
    whole_steps: Floats | None = None,
) -> NeighbourErrors:
    """Run theta and its neighbours over all windows.

    theta: (SIZE,) of the twin; start_states: (windows, 4) x (m), th (rad), v (m/s), w (rad/s).
    free: the parameters along which the neighbours lie.
    power: (channels,) each channel's mean squared error, m^2 or rad^2.
    whole_steps: (more, SIZE) further parameter vectors. Each adds a column: the change of the runs
        from theta all the way to that vector.
    """
    more = np.empty((0, theta.size)) if whole_steps is None else whole_steps
    sets, scale = list_neighbours(theta, free)
    sets = np.concatenate([sets, more])
    acting = np.ones((len(sets), len(start_states)), dtype=bool)
    for row, parameter in zip(acting[1 : 1 + len(free)], free, strict=True):
        row[:] = _list_acting(problem.windows, parameter)
    off = _compute_all_errors(problem, sets, start_states, acting)
    off /= np.sqrt(power)
    none = [0.0] * len(more)
    beliefs = np.array([*(p.belief for p in free), *none])
    return NeighbourErrors(
        off, scale, beliefs, np.array([*(p.compute_pull(theta) for p in free), *none])
    )


def list_neighbours(theta: Floats, free: tuple[Free, ...]) -> tuple[Floats, Floats]:
    """Return theta and its neighbours along each parameter, and each parameter's size / step.

    Shapes (1 + parameters, SIZE) and (parameters,). Where runs jump with a parameter, a small step
    may lie between two jumps: it changes runs as another parameter does, or not at all. The step
    is as wide as a fit can tell the parameter.
    """
    sets = np.repeat(theta[None], 1 + len(free), axis=0)
    scale = np.empty(len(free))
    for k, parameter in enumerate(free):
        value = parameter.get(theta)
        step = max(STEP * parameter.size, JUMPS.get(parameter.name, 0.0) * abs(value))
        step = step if value + step <= parameter.high else -step
        parameter.put(sets[k + 1], value + step)
        scale[k] = parameter.size / step
    return sets, scale


def _list_acting(windows: Windows, parameter: Free) -> Mask:
    """Return in which windows a parameter may act, (windows,)."""
    if parameter.acts is None:
        return np.ones(len(windows.begin), dtype=bool)
    so_far = np.concatenate([[0], np.cumsum(parameter.acts)])
    return so_far[windows.begin + windows.samples] > so_far[windows.begin]


def _compute_all_errors(
    problem: Problem, sets: Floats, start_states: Floats, acting: Mask
) -> Floats:
    """Return measured minus run, (sets + starts that are varied, windows, samples, channels).

    First each parameter vector from the given starts, then the first set from starts one deviation
    off along each entry. A set runs all its windows at once, for what a twin remembers of the
    recorded path takes long to follow.

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
    together = max(RUNS_AT_ONCE // (problem.windows.samples * start_states.size), 1)
    for sharing in _list_groups(problem, len(sets)):
        rows, row_of = run_drive(problem.signals, sets[sharing], problem.step_s)
        lanes = np.flatnonzero(np.isin(set_of, sharing))
        for some in (lanes[a : a + together] for a in range(0, len(lanes), together)):
            own, set_of_lane = np.unique(set_of[some], return_inverse=True)
            lane, window = np.nonzero(acting[some])
            all_errors[some[lane], window] = compute_errors_of_runs(
                problem,
                (rows, row_of[own - sharing[0]]),
                sets[own],
                set_of_lane[lane],
                window,
                start_states[window] + moves[some[lane]],
            )
    for errors, acts in zip(all_errors, acting, strict=True):
        errors[~acts] = all_errors[0, ~acts]
    return all_errors


def _list_groups(problem: Problem, sets: int) -> list[Ints]:
    """Return the sets in groups whose drives fit into memory together."""
    row = len(problem.signals) * count_substeps(problem.signals, problem.step_s)
    size = max(DRIVES_AT_ONCE // row, 1)
    return [np.arange(a, min(a + size, sets)) for a in range(0, sets, size)]
