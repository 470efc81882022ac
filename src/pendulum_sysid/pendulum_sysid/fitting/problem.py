"""The data of a fit, and the errors of a twin's free runs over its windows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pendulum_sysid.fitting.windows import gather, list_channels
from pendulum_sysid.records import Windows
from pendulum_twin.arrays import Floats, Ints
from pendulum_twin.free_runs import run_drive, run_driven
from pendulum_twin.signals import Signals


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
    return compute_errors_of_runs(problem, drives, theta, set_of, every, start_states)


def compute_errors_of_runs(
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
