"""Settle commands that are in doubt by a twin: from which sample on did each of them act?

Before the physics is known, the balance of the cart settles what it can
(`cleaning.acting_samples`). A twin that was fitted says more: a command that counts a sample too
early or too late puts the rest of its window off by many times the noise. The twin runs freely
through windows that overlap by half, and each option of a command is run in the window in whose
middle it lies. In each window the option, or two together, that takes most away is chosen; then
all are run again. Start states are fitted beside the commands. Only windows that are far off are
asked, and their errors count in units of a typical window's: a twin that lacks physics must not
bend commands to it. At both ends of a stretch no window has a sample in its middle, and commands
stay as they are.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.command_doubt import CommandDoubt
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.gauss_newton import OFF, refine_start_states
from pendulum_sysid.fitting.problem import Problem, compute_errors, list_varied
from pendulum_sysid.fitting.windows import WINDOW_S, cut_windows, gather
from pendulum_sysid.records import Windows
from pendulum_twin.arrays import Floats, Ints

PASSES = 8  # at most: two commands of a window are exchanged in each
MOST_OPTIONS = 100  # of a window, those that change a command most; all at 100 Hz
NOWHERE = -1


@dataclass(frozen=True)
class Seen:
    """Hold what the twin leaves of each window, beside the start states.

    problem: the windows, with the commands as they are chosen.
    start_states: (windows, 4), fitted.
    errors: (windows, rows) errors in units of the noise, 0 where nothing is measured; then how far
        the start states are off, in their deviations.
    basis: (windows, rows, states), orthonormal: what start states can take away.
    left: (windows, rows) errors without that.
    power: (windows,) mean square of what is left.
    """

    problem: Problem
    start_states: Floats
    errors: Floats
    basis: Floats
    left: Floats
    power: Floats

    @property
    def typical(self) -> float:
        """Return the power of a typical window, at least that of the noise."""
        return max(1.0, float(np.median(self.power)))

    def take_out(self, errors: Floats, windows: Ints) -> Floats:
        """Return errors (k, rows) without what start states of their windows (k,) take away."""
        basis = self.basis[windows]
        return errors - (basis @ (errors[:, None] @ basis).transpose(0, 2, 1))[..., 0]


def settle_by_twin(case: Case, theta: Floats) -> Case:
    """Return the case with doubtful commands as the twin says; the case itself if none changes.

    theta: (SIZE,) of the twin.
    """
    before = doubt = case.recording.doubt
    windows = cut_windows(case.signals, case.state, WINDOW_S / 2)
    if before is None or doubt is None or case.signals.parts is not None or not len(windows):
        return case
    at = _assign(before, windows)
    settled, seen = case, follow_windows(case, theta, windows)
    if seen.typical > decisions.COMMAND_MOST_TYPICAL:
        return case
    off = seen.power - seen.typical
    for _ in range(PASSES):
        rows, options = _list_options(doubt, at, seen)
        changes = _run_options(settled, theta, seen, doubt, rows, options, at[rows])
        gains = -np.sum(changes * (seen.left[at[rows]] + changes / 2), axis=1) / seen.typical
        gains -= doubt.added_costs[rows, options]
        best = _pick_best(gains, changes / seen.typical**0.5, rows, at[rows])
        if not len(best):
            break
        doubt = doubt.choose(rows[best], options[best])
        settled = _put_in(settled, doubt)
        seen = follow_windows(settled, theta, windows)
    unexplained = np.flatnonzero(
        (seen.power - seen.typical > decisions.COMMAND_MOST_LEFT * off)[at]
    )
    doubt = doubt.choose(unexplained, before.chosen[unexplained])
    same = np.array_equal(doubt.chosen, before.chosen)
    return case if same else _put_in(settled, doubt)


def _put_in(case: Case, doubt: CommandDoubt) -> Case:
    """Return the case with the chosen commands."""
    signals = replace(case.signals, command=doubt.put_into(case.signals.command))
    return replace(case, recording=replace(case.recording, signals=signals, doubt=doubt))


def _assign(doubt: CommandDoubt, windows: Windows) -> Ints:
    """Return for each doubtful sample the window in whose middle half it lies, (k,)."""
    quarter = windows.samples // 4
    number = np.searchsorted(windows.begin, doubt.samples - quarter, side="right") - 1
    within = doubt.samples - windows.begin[np.maximum(number, 0)] < windows.samples - quarter
    return np.where((number >= 0) & within, number, NOWHERE)


def follow_windows(case: Case, theta: Floats, windows: Windows) -> Seen:
    """Run the twin theta (SIZE,) through the windows from fitted start states."""
    problem = case.problem(windows)
    starts = refine_start_states(problem, theta).start_states
    varied = list_varied(problem)
    deviations = problem.deviations[varied]
    errors = _run(case, problem, theta, starts)
    columns = np.empty((*errors.shape, len(varied)))
    for k, (state, deviation) in enumerate(zip(varied, deviations, strict=True)):
        moved = starts.copy()
        moved[:, state] += deviation
        columns[..., k] = _run(case, problem, theta, moved) - errors
    believed = np.broadcast_to(np.eye(len(varied)), (len(windows), len(varied), len(varied)))
    off = (starts - windows.start_states)[:, varied] / deviations
    basis = np.linalg.qr(np.concatenate([columns, believed], axis=1))[0]
    errors = np.concatenate([errors, off], axis=1)
    count = np.maximum(np.count_nonzero(errors, axis=1) - 2 * len(varied), 1)
    seen = Seen(problem, starts, errors, basis, errors, np.zeros(len(windows)))
    left = seen.take_out(errors, np.arange(len(windows)))
    return replace(seen, left=left, power=np.sum(left**2, axis=1) / count)


def _run(case: Case, problem: Problem, theta: Floats, starts: Floats) -> Floats:
    """Return the errors of free runs in units of the noise, (windows, samples x channels)."""
    windows = problem.windows
    _, counts = gather(problem.signals, windows.begin, windows.samples)
    with np.errstate(all="ignore"):
        errors = np.nan_to_num(compute_errors(problem, theta, starts), nan=OFF)
        errors = np.where(counts > 0, np.clip(errors, -OFF, OFF), 0.0) / case.noise
    return np.asarray(errors.reshape(len(windows), -1))


def _list_options(doubt: CommandDoubt, at: Ints, seen: Seen) -> tuple[Ints, Ints]:
    """Return row and option of what may be chosen instead, in windows that are far off."""
    off = (at != NOWHERE) & (seen.power[at] > decisions.COMMAND_FAR_OFF * seen.typical)
    other = np.isfinite(doubt.costs) & off[:, None]
    other[np.arange(len(doubt)), doubt.chosen] = False
    rows, options = np.nonzero(other)
    now = doubt.values[np.arange(len(doubt)), doubt.chosen]
    change = np.abs(doubt.values[rows, options] - now[rows])
    largest = np.lexsort((-change, at[rows]))
    kept = np.sort(largest[_count_in_order(at[rows][largest]) < MOST_OPTIONS])
    return rows[kept], options[kept]


def _run_options(
    case: Case,
    theta: Floats,
    seen: Seen,
    doubt: CommandDoubt,
    rows: Ints,
    options: Ints,
    at: Ints,
) -> Floats:
    """Return how each option changes the errors of its window, (options, rows of errors).

    Options of windows that do not touch are run together. What start states can take away is left
    out.

    at: (options,) window of each.
    """
    changes = np.zeros((len(rows), seen.errors.shape[1]))
    turn = _count_in_order(at)
    for group in {(int(number), int(way)) for number, way in zip(turn, at % 2, strict=True)}:
        these = np.flatnonzero((turn == group[0]) & (at % 2 == group[1]))
        chosen = doubt.choose(rows[these], options[these])
        signals = replace(case.signals, command=chosen.put_into(case.signals.command))
        own = at[these]
        windows = seen.problem.windows.pick(own)
        problem = replace(seen.problem, signals=signals, windows=windows)
        errors = _run(case, problem, theta, seen.start_states[own])
        changes[these, : errors.shape[1]] = errors - seen.errors[own, : errors.shape[1]]
        changes[these] = seen.take_out(changes[these], own)
    return changes


def _count_in_order(at: Ints) -> Ints:
    """Return how many entries of the same value precede each entry of `at`, which rises."""
    first = np.searchsorted(at, at, side="left")
    return np.arange(len(at)) - first


def _pick_best(gains: Floats, changes: Floats, rows: Ints, at: Ints) -> Ints:
    """Return the option, or two together, that gain most in their window and its neighbours.

    Commands that lie near each other look alike, and often two of them are exchanged for each
    other.

    gains: (options,) nats beyond what each option costs.
    changes: (options, rows of errors), in units of a typical window's errors.
    rows: (options,) of the doubt; a command has one option at a time.
    at: (options,) window of each.
    """
    best: dict[int, tuple[float, list[int]]] = {}
    for window in np.unique(at).tolist():
        own = np.flatnonzero(at == window)
        together = gains[own][:, None] + gains[own] - changes[own] @ changes[own].T
        together[rows[own][:, None] == rows[own]] = -np.inf
        np.fill_diagonal(together, gains[own])
        first, second = np.unravel_index(int(np.argmax(together)), together.shape)
        best[window] = float(together[first, second]), sorted({int(own[first]), int(own[second])})
    picked: list[int] = []
    for window, (gain, options) in best.items():
        neighbours = (best[w][0] for w in (window - 1, window + 1) if w in best)
        if gain > 0 and all(gain >= other for other in neighbours):
            picked += options
    return np.array(picked, dtype=np.int64)
