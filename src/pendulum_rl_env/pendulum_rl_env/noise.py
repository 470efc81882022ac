"""Reject samples that jump further than the pendulum can move, but never for ever."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pendulum_rl_env.task import Task
from pendulum_rl_env.transport import NoAnswerError, Sample

REACH_FACTOR = 2.0  # jump that counts as noise, in units of what the task's speed limits allow
VELOCITY_SHARE = 0.25  # of a speed limit: change of a velocity in a step, before the factor
MOST_DROPPED_IN_A_ROW = 3  # then the next sample is accepted: the rig really is there


@dataclass
class NoiseFilter:
    """Keep the last accepted sample, and count the dropped samples.

    task: says how fast cart and pole may move.
    dropped: samples rejected since the filter was made.
    """

    task: Task
    dropped: int = 0
    _dropped_in_a_row: int = 0
    _last: Sample | None = None

    def start(self, sample: Sample) -> Sample:
        """Accept a sample as the first of an episode; raise NoAnswerError for NaN or infinity."""
        if not np.all(np.isfinite(sample.state)):
            raise NoAnswerError(
                f"expected a state of finite numbers, found {sample.state.tolist()}: look at the "
                "rig's sensors, or at the constants of the twin"
            )
        self._last, self._dropped_in_a_row = sample, 0
        return sample

    def select(self, sample: Sample) -> Sample:
        """Return the sample, or the last accepted sample when this one is noise.

        Raises NoAnswerError when samples stay NaN or infinite.
        """
        may_drop = self._dropped_in_a_row < MOST_DROPPED_IN_A_ROW
        if self._last is not None and may_drop and self._is_jump(self._last, sample):
            self.dropped += 1
            self._dropped_in_a_row += 1
            return self._last
        return self.start(sample)

    def _is_jump(self, before: Sample, after: Sample) -> bool:
        """Tell whether the pendulum cannot have moved so far, or a number is not finite."""
        if not np.all(np.isfinite(after.state)):
            return True
        elapsed_steps = (after.stamp_s - before.stamp_s) / self.task.step_s
        # stamps that stand still, or jump back, count as a step each
        periods = max(elapsed_steps, self._dropped_in_a_row + 1.0)
        step_s, v, w = self.task.step_s, self.task.v_limit_m_s, self.task.w_limit_rad_s
        reach = np.array([v * step_s, w * step_s, v * VELOCITY_SHARE, w * VELOCITY_SHARE])
        jump = np.abs(after.state - before.state)
        return bool(np.any(jump > reach * REACH_FACTOR * periods))
