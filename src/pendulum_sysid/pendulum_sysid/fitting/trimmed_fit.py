"""Fit a twin to the better half of a recording, where commands in doubt spoil windows.

A command that counts a sample too early or too late puts its window off by many times the noise,
and a fit to all windows bends its parameters to a few such windows. Least trimmed squares holds
with up to half of the windows spoiled: the half that the twin follows best decides (Rousseeuw, J.
Am. Stat. Assoc. 79 (1984) 871). The fit to a half and the choice of the half alternate until the
half stays (the concentration steps of Rousseeuw and van Driessen, Data Min. Knowl. Discov. 12
(2006) 29).
"""

from __future__ import annotations

import numpy as np

from pendulum_sysid.cleaning.stale_start import compute_slow_speed
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.fit import HORIZONS
from pendulum_sysid.fitting.gauss_newton import Solution, solve
from pendulum_sysid.fitting.parameters import list_free_parameters
from pendulum_sysid.fitting.windows import WINDOW_S, cut_windows
from pendulum_sysid.records import Windows
from pendulum_twin.arrays import Floats, Ints

STEPS = 10  # at most: 2 to 5 on recordings of a busy computer


def fit_to_better_half(case: Case, effects: tuple[str, ...], theta: Floats) -> Floats:
    """Return theta (SIZE,) of the constants and effects, fitted to the better half of the windows.

    Windows are as short as those that a search begins with: errors stay where they arise. A window
    in which the cart hardly moves says nothing, and is not counted.

    theta: (SIZE,) to begin from.
    """
    free = list_free_parameters(case.twin, effects, case.scales)
    windows = _cut_moving_windows(case)
    if len(windows) < 2:
        return theta
    half = np.arange(0)
    for _ in range(STEPS):
        followed = solve(case.problem(windows), theta, ())
        before, half = half, _pick_better_half(followed, case.noise)
        if np.array_equal(before, half):
            break
        problem = case.problem(windows.pick(half))
        theta = solve(problem, theta, free, followed.start_states[half]).theta
    return theta


def _cut_moving_windows(case: Case) -> Windows:
    """Return short windows one after another in which the cart moves."""
    short_s = WINDOW_S / HORIZONS[0]
    windows = cut_windows(case.signals, case.state, short_s, short_s)
    speeds = np.abs(case.state.states[:, 2])
    at = windows.begin[:, None] + np.arange(windows.samples)
    return windows.pick(np.flatnonzero(speeds[at].max(axis=1) > compute_slow_speed(case.state)))


def _pick_better_half(followed: Solution, noise: Floats) -> Ints:
    """Return the windows, rising, that are least off in units of the noise."""
    counts = np.maximum(followed.counts.sum(axis=1), 1.0)
    power = np.sum(followed.squares / noise**2, axis=1) / counts
    return np.sort(np.argsort(power, kind="stable")[: len(power) // 2])
