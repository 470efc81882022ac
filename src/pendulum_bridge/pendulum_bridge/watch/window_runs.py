"""Runs of the twin through one window, and what their differences from the samples look like."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pendulum_twin.arrays import Floats, Ints, Mask
from pendulum_twin.free_runs import run_freely
from pendulum_twin.signals import Signals

FAR = 1e4  # m, rad, or either per unit of what is varied
SPIKE = 8.0  # times the usual bend of the rows: a larger one is no sample of this motion


@dataclass(frozen=True)
class WindowRuns:
    """Run the twin through one window, which begins at sample first of signals; rows as in Reading."""

    signals: Signals
    theta: Floats
    first: int
    joint: Ints
    at: Ints

    def shown(self, sets: Ints, starts: Floats, samples: int) -> tuple[Floats, Floats]:
        """Return what runs of these words show in the rows, (runs, rows), and their states (runs, samples, 4)."""
        states = run_freely(
            self.signals, self.theta, sets, np.full(len(sets), self.first), starts, samples
        )
        return states[:, self.at, self.joint], states

    def later(self, when: Ints, starts: Floats, theta: Floats, samples: int) -> Floats:
        """Return runs of twins with words (runs, SIZE) that start later in the window."""
        return run_freely(
            self.signals, theta, np.arange(len(when)), self.first + when, starts, samples
        )

    def window_command(self, samples: int) -> Floats:
        """Return the window's commands."""
        return self.signals.command[self.first : self.first + samples]


def solved(columns: Floats, off: Floats, deviations: Floats) -> Floats:
    """Return the least-squares sizes of columns (rows, n) that explain off (rows,), held back where they do nothing."""
    scaled = columns / deviations[:, None]
    normal = scaled.T @ scaled
    normal[np.diag_indices_from(normal)] += 1e-6 * np.trace(normal) / len(normal) + 1e-12
    return np.asarray(np.linalg.solve(normal, scaled.T @ (off / deviations)))


def runs_away(rows: Floats) -> bool:
    """Tell whether numbers are none, or far beyond what a rig can show in a window."""
    return not bool(np.all(np.abs(rows) < FAR))


def spikes(off: Floats, joint: Ints, at: Ints, sensor: Floats) -> Mask:
    """Return which rows are off the line through their neighbours by far more than these are off theirs.

    A single wrong sample is twice as far off as both beside it; at a step, which is kept, two
    neighbours are as far off.
    """
    found = np.zeros(len(off), dtype=bool)
    for k in np.unique(joint):
        rows = np.flatnonzero(joint == k)
        if len(rows) < 5:
            continue
        here, t = off[rows], at[rows].astype(float)
        share = (t[1:-1] - t[:-2]) / (t[2:] - t[:-2])
        bent = np.abs(here[1:-1] - (1 - share) * here[:-2] - share * here[2:])
        around = np.pad(bent, 1)
        usual = SPIKE * max(float(np.median(bent)), sensor[k])
        found[rows[1:-1]] = (bent > usual) & (bent > 1.5 * np.maximum(around[:-2], around[2:]))
    return found
