"""Many pendulums as a Gymnasium vector environment: `Fleet` under that interface."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space

from pendulum_rl_env.fleet import Course, Fleet
from pendulum_rl_env.task import End
from pendulum_twin.arrays import Mask


class PendulumVectorEnv(gym.vector.VectorEnv[Any, Any, Any]):
    """Step all pendulums of a fleet in one compiled call.

    Spaces: of one pendulum as in `PendulumEnv`, the action scaled to +-1.
    Restart: an episode that ends begins anew in the same step.

    `info` at an end, valid where `_final_obs` is true:

    final_obs: (n, 5) last observations.
    final_info: episode's r (summed reward) and l (steps), and end (number of the `End`).
    """

    metadata: dict[str, Any] = {  # noqa: RUF012
        "autoreset_mode": AutoresetMode.SAME_STEP,
        "render_modes": [],
    }

    def __init__(self, fleet: Fleet) -> None:
        self.fleet, self.num_envs = fleet, fleet.count
        bounds = fleet.task.bounds
        self.single_observation_space = gym.spaces.Box(-bounds, bounds, dtype=np.float32)
        self.single_action_space = gym.spaces.Box(-1.0, 1.0, (1,), np.float32)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> Any:
        """Begin every episode anew; of a list of seeds the first counts for all."""
        first = seed[0] if isinstance(seed, list) else seed
        return self.fleet.reset(first).copy(), {}

    def step(self, actions: Any) -> Any:
        """Hold actions (n, 1) within +-1, times the PWM limit, for a period.

        Raises BadInputError for an action that is no finite number.
        """
        scaled = np.asarray(actions, dtype=np.float64).reshape(-1)
        course = self.fleet.step(scaled * self.fleet.task.pwm_limit)
        terminated = course.end != End.NONE
        over = terminated | course.truncated
        info = _make_final_info(course, over) if over.any() else {}
        return course.seen.copy(), course.reward.copy(), terminated, course.truncated.copy(), info


def _make_final_info(course: Course, over: Mask) -> dict[str, Any]:
    episode = {"r": np.where(over, course.total, 0.0), "l": np.where(over, course.length, 0)}
    final = {"episode": episode, "_episode": over, "end": course.end.copy(), "_end": over}
    return {
        "final_obs": course.last.copy(),
        "_final_obs": over,
        "final_info": final,
        "_final_info": over,
    }
