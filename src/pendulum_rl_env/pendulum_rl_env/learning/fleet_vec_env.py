"""A fleet as a stable-baselines3 vector environment."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from stable_baselines3.common.vec_env.base_vec_env import VecEnv, VecEnvIndices, VecEnvStepReturn

from pendulum_rl_env.fleet import Fleet
from pendulum_rl_env.task import Task
from pendulum_twin.arrays import Floats


class FleetVecEnv(VecEnv):
    """Step a fleet with actions from -1 to 1.

    It reports every episode's reward and length itself: it needs no Monitor around it.
    """

    def __init__(self, fleet: Fleet) -> None:
        self._fleet, self.render_mode = fleet, None
        bounds = fleet.task.bounds
        super().__init__(
            fleet.count,
            gym.spaces.Box(-bounds, bounds, dtype=np.float32),
            gym.spaces.Box(-1.0, 1.0, (1,), np.float32),
        )
        self._no_info: dict[str, Any] = {}

    def reset(self) -> Any:
        """Begin every episode anew, with the seed given to `seed`, if any."""
        seed = self._seeds[0]
        self._reset_seeds()
        self._reset_options()
        return self._fleet.reset(seed).copy()

    @property
    def task(self) -> Task:
        """Return the task of the pendulums."""
        return self._fleet.task

    @property
    def pwm_limit(self) -> float:
        """Return the largest command that is applied."""
        return self._fleet.pwm_limit

    @property
    def measured(self) -> Floats:
        """Return the measured states now, (n, 4), after a reset where an episode is over."""
        return self._fleet.measured

    @property
    def last_measured(self) -> Floats:
        """Return the measured states at the end of the last step, (n, 4), before a reset."""
        return self._fleet.course.measured

    def step_async(self, actions: Any) -> None:
        """Keep the actions for `step_wait`."""
        scaled = np.asarray(actions, dtype=np.float64).reshape(-1)
        self._actions = scaled * self._fleet.task.pwm_limit

    def step_wait(self) -> VecEnvStepReturn:
        """Step all pendulums; return observations (n, 5), rewards (n,), dones (n,) and infos."""
        course = self._fleet.step(self._actions)
        over = (course.end != 0) | course.truncated
        infos = [self._no_info] * self.num_envs
        for i in np.flatnonzero(over):
            infos[i] = {
                "TimeLimit.truncated": bool(course.truncated[i]),
                "terminal_observation": course.last[i].copy(),
                "episode": {"r": float(course.total[i]), "l": int(course.length[i]), "t": 0.0},
            }
        return course.seen.copy(), course.reward.astype(np.float32), over, infos

    def close(self) -> None:
        """Do nothing: a fleet holds no resource."""

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """Return this environment's attribute, once a pendulum."""
        return [getattr(self, attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Refuse: a fleet's pendulums have no attributes of their own."""
        raise AttributeError(f"a fleet's pendulums have no {attr_name} of their own to be set")

    def env_method(
        self,
        method_name: str,
        *method_args: Any,
        indices: VecEnvIndices = None,
        **method_kwargs: Any,
    ) -> list[Any]:
        """Refuse: a fleet's pendulums are no objects."""
        raise AttributeError(f"a fleet's pendulums have no method {method_name}")

    def env_is_wrapped(
        self, wrapper_class: type[gym.Wrapper[Any, Any, Any, Any]], indices: VecEnvIndices = None
    ) -> list[bool]:
        """Return that no pendulum is wrapped."""
        return [False for _ in self._get_indices(indices)]
