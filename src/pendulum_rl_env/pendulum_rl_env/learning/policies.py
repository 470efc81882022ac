"""Save what was learned, load what `train` has written, and use it as a policy."""

from __future__ import annotations

import json
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import gymnasium as gym
import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.vec_env import DummyVecEnv, VecEnv

from pendulum_rl_env.learning.algorithms import ALGORITHMS, list_settings
from pendulum_rl_env.learning.policy_file import (
    UNREADABLE,
    PolicyFile,
    read_policy_file,
    write_policy_file,
)
from pendulum_rl_env.learning.tensors import collect_tensors, put_tensors
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
