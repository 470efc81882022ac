"""Run the twin through a window, and judge the differences from the samples."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pendulum_twin.arrays import Floats, Ints, Mask
from pendulum_twin.free_runs import run_freely
from pendulum_twin.signals import Signals

RUNAWAY = 1e4  # m, rad, or either per unit of what is varied
SPIKE_FACTOR = 8.0  # times the usual bend of the rows: a larger bend is no sample of this motion
SIDE_FACTOR = 1.5  # times the bend of both neighbours, which a single wrong sample exceeds
RIDGE = 1e-6  # of the mean diagonal, so that columns without effect keep size 0


@dataclass(frozen=True)
class WindowRuns:
    """Run twins through a window.

    signals: commands on an even clock.
    theta: (sets, SIZE) parameter vectors.
    first: sample of signals with which the window begins.
    joint, at: (rows,) joint and sample of each row, see `Reading`.
    """

    signals: Signals
    theta: Floats
    first: int
    joint: Ints
    at: Ints

    def run(self, sets: Ints, starts: Floats, samples: int) -> tuple[Floats, Floats]:
        """Return the rows (runs, rows) and the states (runs, samples, 4) of runs.

        sets: (runs,) row of theta.
        starts: (runs, 4) state at the window's begin.
        """
        states = run_freely(
            self.signals, self.theta, sets, np.full(len(sets), self.first), starts, samples
        )
        return states[:, self.at, self.joint], states

    def run_later(self, when: Ints, starts: Floats, theta: Floats, samples: int) -> Floats:
        """Return the states of runs of twins theta (runs, SIZE) that start later in the window."""
        return run_freely(
            self.signals, theta, np.arange(len(when)), self.first + when, starts, samples
        )

    def select_command(self, samples: int) -> Floats:
        """Return the window's commands."""
        return self.signals.command[self.first : self.first + samples]


def solve_least_squares(columns: Floats, off: Floats, deviations: Floats) -> Floats:
    """Return the sizes of columns that explain off best; a column without effect gets 0.

    columns: (rows, n).
    off: (rows,).
    deviations: (rows,) of off.
    """
    scaled = columns / deviations[:, None]
    normal = scaled.T @ scaled
    normal[np.diag_indices_from(normal)] += RIDGE * np.trace(normal) / len(normal) + 1e-12
    return np.asarray(np.linalg.solve(normal, scaled.T @ (off / deviations)))


def has_run_away(rows: Floats) -> bool:
    """Tell whether a number is not finite, or far beyond what a rig can show in a window."""
    return not bool(np.all(np.abs(rows) < RUNAWAY))


def find_spikes(off: Floats, joint: Ints, at: Ints, sensor: Floats) -> Mask:
    """Return which rows are spikes, (rows,).

    A spike is off the line through its neighbours by far more than they are off theirs. A single
    wrong sample bends twice as much as both beside it; at a step, which is kept, two neighbours
    bend alike.

    off: (rows,) measured minus twin.
    joint, at: (rows,) joint and sample of each row.
    sensor: (2,) standard deviation of a sample, m and rad.
    """
    spikes = np.zeros(len(off), dtype=bool)
    for k in np.unique(joint):
        rows = np.flatnonzero(joint == k)
        if len(rows) < 5:
            continue
        values, t = off[rows], at[rows].astype(float)
        share = (t[1:-1] - t[:-2]) / (t[2:] - t[:-2])
        bend = np.abs(values[1:-1] - (1 - share) * values[:-2] - share * values[2:])
        beside = np.pad(bend, 1)
        usual = SPIKE_FACTOR * max(float(np.median(bend)), sensor[k])
        is_single = bend > SIDE_FACTOR * np.maximum(beside[:-2], beside[2:])
        spikes[rows[1:-1]] = (bend > usual) & is_single
    return spikes
