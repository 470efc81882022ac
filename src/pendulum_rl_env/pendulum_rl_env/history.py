"""Show a policy its last samples and commands, which it needs where a delay hides their effect.

An observation with history is the observation now, then for each of the last periods, the latest
first, the observation before it and the action (-1 to 1) of it.
"""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

Observations = NDArray[np.float32]


class History:
    """Keep the last samples and actions of pendulums side by side.

    count: of pendulums.
    size: of an observation.
    length: periods that are kept.
    """

    def __init__(self, count: int, size: int, length: int) -> None:
        self._past = np.zeros((count, length, size + 1), dtype=np.float32)
        self._now = np.zeros((count, size), dtype=np.float32)

    def begin(self, rows: Any, observations: Observations) -> None:
        """Begin episodes: the past is the first sample, and no action."""
        self._now[rows] = observations
        self._past[rows, :, :-1] = observations[:, None]
        self._past[rows, :, -1] = 0.0

    def append(self, actions: Observations, observations: Observations) -> None:
        """Add a period: the action (count, 1) of each pendulum and the sample after it."""
        if self._past.shape[1]:
            self._past[:, 1:] = self._past[:, :-1].copy()
            self._past[:, 0, :-1] = self._now
            self._past[:, 0, -1] = np.clip(actions[:, 0], -1.0, 1.0)
        self._now[:] = observations

    def show(self) -> Observations:
        """Return the observations with history, (count, size + length (size + 1))."""
        return np.concatenate([self._now, self._past.reshape(len(self._now), -1)], axis=1)


def extend_space(space: gym.Space[Any], length: int) -> gym.spaces.Box:
    """Return the space of observations with history; actions go from -1 to 1."""
    assert isinstance(space, gym.spaces.Box)
    full = np.ones(1, dtype=np.float32)
    low, high = (
        np.concatenate([bound, *[bound, sign * full] * length])
        for bound, sign in ((space.low, -1), (space.high, 1))
    )
    return gym.spaces.Box(low, high, dtype=np.float32)


def count_periods(shown: int, size: int) -> int | None:
    """Return how many past periods an observation of `shown` numbers holds; None for no number.

    size: of an observation without history.
    """
    length, rest = divmod(shown - size, size + 1)
    return length if length >= 0 and not rest else None


class HistoryObservation(gym.Wrapper[Any, Any, Any, Any]):
    """Show observations with history; actions go from -1 to 1.

    length: periods that are kept.
    """

    def __init__(self, env: gym.Env[Any, Any], length: int) -> None:
        super().__init__(env)
        self.observation_space = extend_space(env.observation_space, length)
        assert env.observation_space.shape is not None
        self._history = History(1, env.observation_space.shape[0], length)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observations, dict[str, Any]]:
        """Begin an episode."""
        observation, info = self.env.reset(seed=seed, options=options)
        self._history.begin(slice(None), observation[None])
        return self._history.show()[0], info

    def step(self, action: Any) -> tuple[Observations, Any, bool, bool, dict[str, Any]]:
        """Hold an action for a period."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        self._history.append(np.asarray(action, dtype=np.float32)[None], observation[None])
        return self._history.show()[0], reward, terminated, truncated, info
