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

from pendulum_sysid.fitting.neighbours import NeighbourErrors, run_neighbours
from pendulum_sysid.fitting.parameters import Free
from pendulum_sysid.fitting.problem import Problem, list_varied
from pendulum_twin.arrays import Floats, Mask

FAR = 1e6  # deviations: as wrong as a run may count that has left all bounds
ERRORS_AT_ONCE = 250_000  # numbers of errors multiplied at one time: a processor's own cache


@dataclass(frozen=True)
class System:
    """Hold normal equations with the start states eliminated, and what gives them back.

    Residuals are in units of each channel's deviation. A column is the change of the runs by a
    parameter's size. Of a start state s entries are fitted, at most 4.

    normals: (windows, columns, columns) each window's part of the matrix.
    scores: (windows, columns) each window's part of the gradient. In a system that is summed, both
        hold the parts of several windows together: enough for a step, and made six times as fast.
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

    def sum_windows(self, kept: Mask) -> System:
        """Return the summed system of some windows; kept: (windows,)."""
        normal = np.tensordot(kept.astype(float), self.normals, axes=1)
        return replace(
            self,
            normals=normal[None],
            scores=self.scores[kept].sum(axis=0, keepdims=True),
        )

    def move(self, columns: Sequence[int], steps: Floats) -> System:
        """Return the system after steps (columns,) of some parameters, in their sizes."""
        changed = self.normals[:, :, columns] @ steps
        return replace(self, scores=self.scores - changed)

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
    summed: bool = False,
) -> System:
    """Compute the normal equations at theta and start states, by differences.

    See `run_neighbours` and `assemble` for the arguments.
    """
    errors = run_neighbours(problem, theta, start_states, free, power, whole_steps)
    return assemble(problem, start_states, errors, summed=summed)


def assemble(
    problem: Problem, start_states: Floats, *errors: NeighbourErrors, summed: bool = False
) -> System:
    """Return the normal equations of all columns of one or more sets of neighbours.

    errors: of vectors that run alike, from these start states; whole steps may stand in the last.
    summed: whether the sum over the windows is enough.
    """
    first, *others = errors
    varied = list_varied(problem)
    scale = np.concatenate([each.scale for each in errors])
    count = len(first.off) + sum(len(each.beliefs) for each in others)

    def list_errors(part: slice) -> Floats:
        if not others:
            return first.off[:, part]
        columns = [each.columns[:, part] for each in errors]
        return np.concatenate([first.off[:1, part], *columns, first.off[-len(varied) :, part]])

    pieces = _list_pieces(first.off[0], count)
    systems = [
        _assemble_part(problem, list_errors(part), scale, start_states, part, summed)
        for part in pieces
    ]

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
        beliefs=np.concatenate([each.beliefs for each in errors]),
        pulls=np.concatenate([each.pulls for each in errors]),
    )


def _list_pieces(off: Floats, vectors: int) -> list[slice]:
    """Return the windows in pieces; off: (windows, samples, channels) errors of one vector."""
    size = max(ERRORS_AT_ONCE * len(off) // (vectors * off.size), 1)
    return [slice(a, min(a + size, len(off))) for a in range(0, len(off), size)]


def _assemble_part(
    problem: Problem,
    off_by: Floats,
    scale: Floats,
    start_states: Floats,
    part: slice,
    summed: bool,
) -> System:
    """Return the normal equations of a part of the windows.

    off_by: (sets + varied starts, windows, samples, channels) their errors, in units of each
        channel's deviation, in the order of `NeighbourErrors`.
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
    if summed:
        every = change[: sets - 1].reshape(sets - 1, base.size)
        crossed, followed = (m.reshape(start_gradient.size, sets - 1) for m in (cross, moved))
        scores = (every @ base.ravel() - followed.T @ start_gradient.ravel())[None]
        normals = (every @ every.T - crossed.T @ followed)[None]
    else:
        scores = (by_column.transpose(0, 2, 1) @ base[..., None])[..., 0]
        scores -= (moved.transpose(0, 2, 1) @ start_gradient[..., None])[..., 0]
        normals = by_column.transpose(0, 2, 1) @ by_column - cross.transpose(0, 2, 1) @ moved
    return System(normals, scores, start_normal, start_gradient, cross, sizes, varied)
