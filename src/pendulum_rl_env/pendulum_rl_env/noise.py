"""Samples that jump further than anything moves are noise: dropped and counted, but never for ever."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pendulum_rl_env.task import Task
from pendulum_rl_env.transport import Sample

REACH_FACTOR = (
    2.0  # times what the limits of speed allow; and of velocities, times half the limit a step
)
MOST_DROPPED_IN_A_ROW = (
    3  # of dropped samples; the next is believed, for then it is where the rig is
)


@dataclass
class NoiseFilter:
    """Keep the last sample that was believed, and count what was dropped."""

    task: Task
    dropped: int = 0
    _row: int = 0
    _last: Sample | None = None

    def start(self, sample: Sample) -> Sample:
        """Believe the first sample of an episode."""
        self._last, self._row = sample, 0
        return sample

    def believed(self, sample: Sample) -> Sample:
        """Return the sample, or the last one that was believed when this one cannot be."""
        if (
            self._last is not None
            and self._row < MOST_DROPPED_IN_A_ROW
            and self.jumps(self._last, sample)
        ):
            self.dropped += 1
            self._row += 1
            return self._last
        return self.start(sample)

    def jumps(self, before: Sample, after: Sample) -> bool:
        """Tell whether a sample is further from the one before than the pendulum can have come, or not finite."""
        if not np.all(np.isfinite(after.state)):
            return True
        periods = self._row + max((after.stamp_s - before.stamp_s) / self.task.step_s, 1.0)
        v, w = self.task.v_limit_m_s, self.task.w_limit_rad_s
        reach = (
            np.array([v * self.task.step_s, w * self.task.step_s, v / 4, w / 4])
            * REACH_FACTOR
            * periods
        )
        return bool(np.any(np.abs(after.state - before.state) > reach))
