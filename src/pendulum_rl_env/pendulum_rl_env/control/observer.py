"""An observer: a twin runs beside the rig, and every measured position corrects its state.

It ignores reported velocities, for rigs make them in different ways. It predicts from the
corrected state, through all that the drive remembers.
"""

from __future__ import annotations

import numpy as np

from pendulum_rl_env.control.rollouts import Snapshot, take_snapshot
from pendulum_rl_env.kernel_transport import count_samples
from pendulum_twin import lanes
from pendulum_twin.arrays import Floats
from pendulum_twin.model import Twin
from pendulum_twin.sensors import undo_sensors

VELOCITY_GAIN = 0.8  # of the mean velocity's error that a position shows


class Observer:
    """Estimate the true state x, th, v, w at the times at which commands are sent.

    twin: the rig as it is believed to be.
    step_s: s; from command to command.
    ahead_s: s; how far `predict` looks ahead.
    """

    def __init__(self, twin: Twin, step_s: float, ahead_s: float = 0.0) -> None:
        self._timing = lanes.make_timing(step_s, count_samples(step_s))
        self._kinds = lanes.make_kinds([twin], self._timing)
        self._code = lanes.select_lane_code(self._kinds, 1)
        self._lanes = lanes.make_lanes(self._kinds, self._timing, 1)
        substep_s = self._timing.sample_s / self._timing.sub
        substeps = round(ahead_s / substep_s)
        self._later = lanes.Timing(1, substeps, substeps * substep_s) if substeps else None
        if self._later is not None:
            self._ahead = lanes.make_lanes(self._kinds, self._later, 1)
        self._true_step_s = step_s * float(self._kinds.paces[0])  # by a true clock
        self._steps = 0
        self._has_begun = False

    def reset(self) -> None:
        """Forget everything; the next measurement begins an episode."""
        self._has_begun = False

    def correct(self, measured: Floats, command: float) -> Floats:
        """Return the true state (4,) behind a measured state.

        measured: (4,) x, th, v, w as reported.
        command: PWM fraction, held since the last call.
        """
        if not self._has_begun:
            return self._begin(measured)
        self._hold(command)
        self._steps += 1
        state = self._lanes.true[0]
        seen = undo_sensors(measured[None], self._kinds.theta, self._now)[0]
        error = seen[:2] - state[:2]
        state[:2] += error
        state[2:] += VELOCITY_GAIN * error / self._true_step_s
        return state.copy()

    def predict(self, command: float) -> Floats:
        """Return the true state (4,) ahead_s later, the command being held meanwhile."""
        if self._later is None:
            return self._lanes.true[0].copy()
        for name in ("theta", "memory", "path_memory", "done", "true", "shown"):
            getattr(self._ahead, name)[:] = getattr(self._lanes, name)
        lanes.advance_lanes_from_python(
            self._code, self._kinds, self._ahead, self._later, np.array([command])
        )
        return self._ahead.true[0].copy()

    def make_snapshot(self) -> Snapshot:
        """Return the twin as it is believed to be now, with all that its drive remembers."""
        return take_snapshot(self._lanes)

    def _begin(self, measured: Floats) -> Floats:
        """Start at the measured state, with a drive that has been still for long."""
        lanes.begin_lane_from_python(self._kinds, self._lanes, self._timing, 0, 0, lanes.AT_REST)
        self._steps, self._has_begun = 0, True
        self._lanes.true[0] = undo_sensors(measured[None], self._kinds.theta, self._now)[0]
        return self._lanes.true[0].copy()

    def _hold(self, command: float) -> None:
        lanes.advance_lanes_from_python(
            self._code, self._kinds, self._lanes, self._timing, np.array([command])
        )

    @property
    def _now(self) -> Floats:
        """Return the time by the stamps, s, (1,)."""
        return np.array([self._steps * self._timing.samples * self._timing.sample_s])
