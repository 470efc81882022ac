"""A twin that runs beside the rig with the same commands and is put right by every measured position.

Reported velocities are not looked at: rigs differ in how they make them. Prediction goes on from
there, through all that the drive still remembers.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pendulum_rl_env.kernel_transport import count_samples
from pendulum_twin import lanes
from pendulum_twin.free_runs import pass_through_sensors, select_measuring_effects, undo_sensors
from pendulum_twin.model import Twin

Floats = NDArray[np.float64]

VELOCITY_GAIN = 0.8  # of the mean velocity's error that a position shows


class Observer:
    """Estimate the true state x, th, v, w of a rig that is as the twin is, at the times at which commands are sent.

    step_s: from command to command. ahead_s: how far `ahead` predicts.
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
        self._step_s = step_s * float(self._kinds.paces[0])  # as it really passes
        theta = self._kinds.theta
        self._undoing = [
            replace(each, law=each.inverse)
            for each in reversed(select_measuring_effects(theta))
            if each.inverse is not None
        ]
        self._steps = 0
        self._begun = False

    def reset(self) -> None:
        """Know nothing any more."""
        self._begun = False

    def seen(self, measured: Floats, command: float) -> Floats:
        """Return the true state that a measured one shows; command: what was held since the last call."""
        if not self._begun:
            return self._begin(measured)
        self._hold(command)
        self._steps += 1
        true = self._lanes.true[0]
        off = (
            pass_through_sensors(measured[None], self._kinds.theta, self._undoing, self._now)[
                0, :2
            ]
            - true[:2]
        )
        true[:2] += off
        true[2:] += VELOCITY_GAIN * off / self._step_s
        return true.copy()

    def ahead(self, command: float) -> Floats:
        """Return the true state ahead_s later, if this command is held meanwhile."""
        if self._later is None:
            return self._lanes.true[0].copy()
        for name in ("theta", "memory", "done", "true", "shown"):
            getattr(self._ahead, name)[:] = getattr(self._lanes, name)
        lanes.advance_lanes_from_python(
            self._code, self._kinds, self._ahead, self._later, np.array([command])
        )
        return self._ahead.true[0].copy()

    def _begin(self, measured: Floats) -> Floats:
        """Start where the rig is, with a drive that has done nothing for long."""
        lanes.begin_lane_from_python(self._kinds, self._lanes, self._timing, 0, 0, lanes.AT_REST)
        self._steps, self._begun = 0, True
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
