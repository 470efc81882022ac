"""Integrate accelerations from start states, driven by the recorded command."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pendulum_sysid.records import Windows
from pendulum_twin.arrays import Floats
from pendulum_twin.signals import Signals

# v' (m/s^2) and w' (rad/s^2), (k, 2), at states (k, 4) and commands (k,)
Accelerations = Callable[[Floats, Floats], Floats]
LONGEST_STEP_S = 0.005


def integrate(accelerations: Accelerations, signals: Signals, windows: Windows) -> Floats:
    """Return runs (windows, samples, 4) by the Runge-Kutta method of fourth order.

    The command is held from sample to sample. A run that diverges ends in infinities or NaN.
    """
    steps = max(int(np.ceil(signals.period_s / LONGEST_STEP_S - 1e-9)), 1)
    h = signals.period_s / steps
    runs = np.empty((len(windows), windows.samples, 4))
    runs[:, 0] = states = windows.start_states
    with np.errstate(all="ignore"):
        for n in range(windows.samples - 1):
            command = signals.command[windows.begin + n]
            for _ in range(steps):
                states = step_states(accelerations, states, command, h)
            runs[:, n + 1] = states
    return runs


def step_states(accelerations: Accelerations, states: Floats, command: Floats, h: float) -> Floats:
    """Return states (k, 4) after h s."""

    def change_states(at: Floats) -> Floats:
        return np.concatenate([at[:, 2:], accelerations(at, command)], axis=1)

    first = change_states(states)
    second = change_states(states + 0.5 * h * first)
    third = change_states(states + 0.5 * h * second)
    fourth = change_states(states + h * third)
    return states + h / 6.0 * (first + 2.0 * (second + third) + fourth)
