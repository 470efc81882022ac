"""Save what was learned, load what `train` has written, and use it as a policy."""

from __future__ import annotations

import json
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import gymnasium as gym
import numpy as np
import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.vec_env import DummyVecEnv, VecEnv

from pendulum_rl_env.history import History, HistoryObservation, count_periods
from pendulum_rl_env.learning.algorithms import ALGORITHMS, list_settings
from pendulum_rl_env.learning.policy_file import (
    UNREADABLE,
    PolicyFile,
    read_policy_file,
    write_policy_file,
)
from pendulum_rl_env.learning.tensors import collect_tensors, put_tensors
from pendulum_rl_env.task import Task, make_observation
from pendulum_twin.arrays import Floats
from pendulum_twin.errors import BadInputError

BY_MODULE = {  # stable-baselines3's files name the module of the policy's class
    algorithm.policy_aliases["MlpPolicy"].__module__: algorithm
    for algorithm in ALGORITHMS.values()
}
NAMES = {algorithm: name for name, algorithm in ALGORITHMS.items()}
# Nothing is learned by a policy that is only used, so nothing is kept for replay.
SMALL = {"buffer_size": 1, "learning_starts": 0}


def save_policy(model: BaseAlgorithm, path: Path) -> None:
    """Write a learner as a `policy.zip`; see `policy_file.py`."""
    algorithm = NAMES[type(model)]
    settings = {name: getattr(model, name, None) for name in sorted(list_settings(algorithm))}
    content = PolicyFile(
        algorithm,
        tuple(model.policy_kwargs["net_arch"]),
        model.observation_space,
        model.action_space,
        {name: value for name, value in settings.items() if isinstance(value, int | float | str)},
        model.num_timesteps,
        collect_tensors(model),
    )
    write_policy_file(content, path)


def load_policy(
    path: str | Path,
    trust: bool = False,
    env: VecEnv | None = None,
    settings: Mapping[str, Any] | None = None,
) -> BaseAlgorithm:
    """Return the learner in a file.

    path: of a file that `train` has written.
    trust: whether a file of stable-baselines3 is read as well, which may run code.
    env: where it is to learn; without one it can be used, and cannot learn.
    settings: of the algorithm, in place of those in the file.

    Raises BadInputError for any other file.
    """
    torch.set_num_threads(1)
    file = Path(path)
    if not file.is_file():
        raise BadInputError(f"{path}: expected a policy that `train` has written, found no file")
    content = read_policy_file(file)
    if content is not None:
        return _build_learner(content, file, env, settings)
    if not trust:
        raise BadInputError(
            f"{path}: expected a policy that `train` has written, found a file of "
            "stable-baselines3, which may run any code when it is read: give --trust if you "
            "trust its maker"
        )
    return _load_foreign(file, env, settings)


def _build_learner(
    content: PolicyFile, file: Path, env: VecEnv | None, settings: Mapping[str, Any] | None
) -> BaseAlgorithm:
    known = list_settings(content.algorithm)
    given = {name: value for name, value in content.settings.items() if name in known}
    where = env or DummyVecEnv([lambda: _Spaces(content.observation_space, content.action_space)])
    if env is None:
        given |= {name: value for name, value in SMALL.items() if name in known}
    try:
        with warnings.catch_warnings():  # about sizes of batches, of a learner that never learns
            warnings.simplefilter("ignore")
            model = ALGORITHMS[content.algorithm](
                "MlpPolicy",
                where,
                device="cpu",
                policy_kwargs={"net_arch": list(content.layers)},
                **{**given, **(settings or {})},
            )
        put_tensors(model, content.tensors)
    except (AssertionError, *UNREADABLE) as error:
        raise BadInputError(
            f"{file}: expected a policy that `train` has written, found one that does not fit "
            f"itself ({error})"
        ) from error
    model.num_timesteps = content.timesteps
    return model


def _load_foreign(
    file: Path, env: VecEnv | None, settings: Mapping[str, Any] | None
) -> BaseAlgorithm:
    """Return the learner in a file of stable-baselines3, which may run any code."""
    try:
        with ZipFile(file) as archive:
            module = json.loads(archive.read("data"))["policy_class"]["__module__"]
        return BY_MODULE[module].load(file, env, device="cpu", custom_objects=dict(settings or {}))
    except Exception as error:  # a damaged pickle raises anything
        raise BadInputError(
            f"{file}: expected a policy of stable-baselines3, found none in it ({error})"
        ) from error


class _Spaces(gym.Env[Any, Any]):
    """Have the spaces of an environment and nothing else: nobody steps it."""

    def __init__(self, observations: gym.Space[Any], actions: gym.Space[Any]) -> None:
        self.observation_space, self.action_space = observations, actions


def make_policy(model: BaseAlgorithm) -> Callable[[Any], Any]:
    """Return the deterministic policy: observation (5,) to action (1,) within +-1, or an index."""
    return lambda observation: model.predict(observation, deterministic=True)[0]


def show_history(env: gym.Env[Any, Any], model: BaseAlgorithm) -> gym.Env[Any, Any]:
    """Return the environment with observations as the policy expects them: with its history.

    Raises BadInputError when no history of the environment's observations has this size.
    """
    shape, here = model.observation_space.shape, env.observation_space.shape
    length = count_periods(shape[0], here[0]) if shape and here else None
    if length is None:
        raise BadInputError(
            f"expected a policy for observations {here}, alone or with history, found {shape}"
        )
    return HistoryObservation(env, length) if length else env


class PolicyController:
    """Give a PWM fraction for a measured state by a learned policy; `reset` before each episode.

    model: the learner.
    task: its task.
    """

    def __init__(self, model: BaseAlgorithm, task: Task) -> None:
        assert model.observation_space.shape is not None
        length = count_periods(model.observation_space.shape[0], 5)
        if length is None:
            raise BadInputError(
                "expected a policy for observations (5,), alone or with history, found "
                f"{model.observation_space.shape}"
            )
        self._choose, self._task = make_policy(model), task
        self._history = History(1, 5, length)
        self.reset()

    def reset(self) -> None:
        """Begin an episode."""
        self._action: Any = None

    def __call__(self, measured: Floats) -> float:
        """Return the PWM fraction to hold until the next sample; measured: (4,) x, th, v, w."""
        seen = make_observation(measured, self._task)[None]
        if self._action is None:
            self._history.begin(slice(None), seen)
        else:
            self._history.append(self._action[None], seen)
        self._action = self._choose(self._history.show()[0])
        return self._task.pwm_limit * float(np.clip(self._action[0], -1.0, 1.0))


def load_controller(path: Path, task: Task) -> PolicyController:
    """Return the policy in a file that `train` has written, as a controller."""
    return PolicyController(load_policy(path), task)
