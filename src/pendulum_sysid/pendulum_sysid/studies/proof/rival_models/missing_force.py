"""The force and torque that a twin lacks along a recording, and runs of the twin with them.

Measured accelerations are smoothed, which rounds every kink of the command and of dry friction; so
the twin's own accelerations go through the same smoothing before they are subtracted.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pendulum_sysid.fitting.case import Case
from pendulum_sysid.records import Windows
from pendulum_sysid.studies.proof.rivals.library import find_half_length, smooth_like_positions
from pendulum_twin.arrays import Floats, Mask
from pendulum_twin.free_runs import run_drive, run_driven
from pendulum_twin.inverse_dynamics import compute_missing_force
from pendulum_twin.parameter_vector import COUPLING, INERTIA, MASS
from pendulum_twin.sensors import apply_sensors, undo_sensors
from pendulum_twin.signals import Signals

# force (N) and torque (N m), (k, 2), of true states (k, 4) and commands (k,)
ForceLaw = Callable[[Floats, Floats], Floats]


@dataclass(frozen=True)
class MissingForce:
    """Hold what a twin lacks along a recording.

    states: (n, 4) true x (m), th (rad), v (m/s), w (rad/s) behind the smoothed ones.
    command: (n,) mean about each sample: a command is held before it, the next after it.
    forces: (n, 2) force (N) on the cart, torque (N m) on the pole.
    usable: (n,) where they count.
    """

    states: Floats
    command: Floats
    forces: Floats
    usable: Mask


def measure_missing_force(case: Case, theta: Floats) -> MissingForce:
    """Return the force and torque that a twin theta (SIZE,) lacks along a recording."""
    signals, state = case.signals, case.state
    still = np.zeros_like(state.accelerations)
    needed, usable = compute_missing_force(signals, state.states, state.accelerations, theta)
    lacking = compute_missing_force(signals, state.states, still, theta)[0]
    true = undo_sensors(state.states[None], theta[None], signals.clock_s)[0]
    accelerations = compute_accelerations(theta, true[:, 1], -lacking)
    half = find_half_length(signals)
    smoothed = np.stack(
        [smooth_like_positions(column, signals, half) for column in accelerations.T], axis=1
    )
    own = compute_forces(theta, true[:, 1], smoothed)
    return MissingForce(true, average_command(signals), needed - lacking - own, usable)


def average_command(signals: Signals) -> Floats:
    """Return the mean of the commands before and after each sample, (n,)."""
    command = signals.command
    return 0.5 * (command + np.append(command[:1], command[:-1]))


def compute_accelerations(theta: Floats, angle: Floats, forces: Floats) -> Floats:
    """Return the accelerations (k, 2) that forces (k, 2) cause at angles (k,)."""
    coupled = theta[COUPLING] * np.cos(angle)
    inverse = 1.0 / (theta[MASS] * theta[INERTIA] - coupled**2)
    force, torque = forces.T
    return np.stack(
        [
            (theta[INERTIA] * force + coupled * torque) * inverse,
            (theta[MASS] * torque + coupled * force) * inverse,
        ],
        axis=1,
    )


def compute_forces(theta: Floats, angle: Floats, accelerations: Floats) -> Floats:
    """Return the forces (k, 2) behind accelerations (k, 2) at angles (k,)."""
    coupled = theta[COUPLING] * np.cos(angle)
    a, b = accelerations.T
    return np.stack([theta[MASS] * a - coupled * b, theta[INERTIA] * b - coupled * a], axis=1)


@dataclass(frozen=True)
class PushedTwin:
    """A twin on which a further force and torque act.

    In each sample period the twin moves by itself, between two halves of the further push (Strang,
    SIAM J. Numer. Anal. 5 (1968) 506): an error of second order in the period.

    theta: (SIZE,) of the twin.
    push: the further force and torque.
    """

    theta: Floats
    push: ForceLaw

    def run(self, signals: Signals, windows: Windows) -> Floats:
        """Return free runs; see `Model`."""
        theta = self.theta[None]
        drives = run_drive(signals, theta)
        set_of = np.zeros(len(windows), dtype=np.int64)
        runs = np.empty((len(windows), windows.samples, 4))
        runs[:, 0] = windows.start_states
        for n in range(windows.samples - 1):
            at = windows.begin + n
            command = signals.command[at]
            states = self._push_half(runs[:, n], command, signals.clock_s[at], signals.period_s)
            states = run_driven(signals, drives, theta, set_of, at, states, 2)[:, 1]
            after = signals.clock_s[at] + signals.period_s
            runs[:, n + 1] = self._push_half(states, command, after, signals.period_s)
        return runs

    def _push_half(
        self, states: Floats, command: Floats, times_s: Floats, period_s: float
    ) -> Floats:
        """Return measured states (k, 4) after half a period of the push alone."""
        theta, set_of = self.theta[None], np.zeros(len(states), dtype=np.int64)
        true = undo_sensors(states, theta, times_s, set_of)
        forces = self.push(true, command)
        true[:, 2:] += 0.5 * period_s * compute_accelerations(self.theta, true[:, 1], forces)
        return apply_sensors(true, theta, times_s, set_of)
