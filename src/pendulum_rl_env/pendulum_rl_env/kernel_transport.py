"""The twin in process, as a transport."""

from __future__ import annotations

import math

import numpy as np

from pendulum_rl_env.transport import Sample
from pendulum_rl_env.waiting import announce_compiling
from pendulum_twin import lanes
from pendulum_twin.encoders import EXACT, Encoders
from pendulum_twin.model import Twin

SAMPLE_S = 0.01  # the rig's own period; a command is held for several


class KernelTransport:
    """Step one twin as fast as the machine goes; recording effects are left out.

    twin: the rig as it is believed to be.
    step_s: s; from command to command, a whole number of samples of about 10 ms.
    encoders: how finely positions are measured.
    aside_rad: distance from hanging at which a reset lets the pole go.
    """

    def __init__(
        self, twin: Twin, step_s: float, encoders: Encoders = EXACT, aside_rad: float = 0.0
    ) -> None:
        twin = twin.drop_recording_effects()
        self.step_s, self._aside = step_s, (0.0, aside_rad, 0.0, 0.0)
        self._limit = twin.rig.pwm_limit or math.inf
        self._timing = lanes.make_timing(step_s, count_samples(step_s))
        self._kinds = lanes.make_kinds([twin], self._timing, encoders)
        self._lanes = lanes.make_lanes(self._kinds, self._timing, 1)
        self._code = lanes.select_lane_code(self._kinds, 1)
        self._command = np.zeros(1)
        self._steps = 0
        self.reset()
        with announce_compiling("pendulum_rl_env"):
            self.exchange(0.0)  # a first call compiles, which is not to happen within an episode
        self.reset()

    def reset(self) -> Sample:
        """Hang at rest in the middle, the drive's memory empty."""
        lanes.begin_lane_from_python(self._kinds, self._lanes, self._timing, 0, 0, self._aside)
        self._steps = 0
        return self._make_sample(0.0)

    def exchange(self, command: float) -> Sample:
        """Hold the command, within the rig's limit, for a period; return the sample at its end."""
        self._command[0] = min(max(command, -self._limit), self._limit)
        lanes.advance_lanes_from_python(
            self._code, self._kinds, self._lanes, self._timing, self._command
        )
        self._steps += 1
        return self._make_sample(self.step_s)

    def close(self) -> None:
        """Do nothing: a twin in process holds no resource."""

    def _make_sample(self, dt_s: float) -> Sample:
        info = {"dt_s": dt_s, "pwm_limit": self._limit}
        return Sample(self._lanes.shown[0].copy(), self._steps * self.step_s, info)


def count_samples(step_s: float) -> int:
    """Return the number of samples in a step, at least one."""
    return max(1, round(step_s / SAMPLE_S))
