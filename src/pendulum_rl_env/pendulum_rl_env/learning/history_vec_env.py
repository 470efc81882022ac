"""Observations with history for stable-baselines3; see `history.py`."""

from __future__ import annotations

from typing import Any

import numpy as np
from stable_baselines3.common.vec_env.base_vec_env import VecEnv, VecEnvStepReturn, VecEnvWrapper

from pendulum_rl_env.history import History, extend_space


class HistoryVecEnv(VecEnvWrapper):
    """Show the observations of a vector environment with history.

    length: periods that are kept.
    """

    def __init__(self, venv: VecEnv, length: int) -> None:
        super().__init__(venv, extend_space(venv.observation_space, length))
        assert venv.observation_space.shape is not None
        self._history = History(venv.num_envs, venv.observation_space.shape[0], length)

    def reset(self) -> Any:
        """Begin every episode anew."""
        seen = self.venv.reset()
        assert isinstance(seen, np.ndarray)
        self._history.begin(slice(None), seen)
        return self._history.show()

    def step_async(self, actions: Any) -> None:
        """Keep the actions for `step_wait`."""
        self._actions = np.asarray(actions, dtype=np.float32)
        self.venv.step_async(actions)

    def step_wait(self) -> VecEnvStepReturn:
        """Step all pendulums; a terminal observation has its history, too."""
        seen, rewards, dones, infos = self.venv.step_wait()
        assert isinstance(seen, np.ndarray)
        last, over = seen.copy(), np.flatnonzero(dones)
        for i in over:
            last[i] = infos[i]["terminal_observation"]
        self._history.append(self._actions, last)
        if len(over):
            shown = self._history.show()
            for i in over:
                infos[i] = {**infos[i], "terminal_observation": shown[i]}
            self._history.begin(over, seen[over])
        return self._history.show(), rewards, dones, infos
