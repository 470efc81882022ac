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

from pendulum_rl_env.correction import CorrectedEnv, Correction, Corrector
from pendulum_rl_env.learning.algorithms import ALGORITHMS, discard_log, list_settings
from pendulum_rl_env.learning.correcting_policy import CorrectingPolicy
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
        get_correction(model),
        get_task(model),
    )
    write_policy_file(content, path)


def get_correction(model: BaseAlgorithm) -> Correction | None:
    """Return what the learner's policy corrects; None when the command is all its own."""
    policy = model.policy
    return policy.correction if isinstance(policy, CorrectingPolicy) else None


def get_task(model: BaseAlgorithm) -> Task | None:
    """Return the task that the learner's policy is for: largest command and sample time.

    It is the task of the environment that it learns in, or what its file said; None when the file
    did not say, or the environment has another task.
    """
    correction = get_correction(model)
    if correction is not None:
        return correction.base.task
    env = model.get_env()
    try:
        task = None if env is None else env.get_attr("task")[0]
    except AttributeError:
        return None
    return task if isinstance(task, Task) else None


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
    if content is None and not trust:
        raise BadInputError(
            f"{path}: expected a policy that `train` has written, found a file of "
            "stable-baselines3, which may run any code when it is read: give --trust if you "
            "trust its maker"
        )
    model = (
        _load_foreign(file, env, settings)
        if content is None
        else _build_learner(content, file, env, settings)
    )
    discard_log(model)
    return model


def _build_learner(
    content: PolicyFile, file: Path, env: VecEnv | None, settings: Mapping[str, Any] | None
) -> BaseAlgorithm:
    known = list_settings(content.algorithm)
    given = {name: value for name, value in content.settings.items() if name in known}
    where = env or DummyVecEnv([lambda: _Spaces(content)])
    if env is None:
        given |= {name: value for name, value in SMALL.items() if name in known}
    policy: str | type[CorrectingPolicy] = "MlpPolicy"
    policy_settings: dict[str, Any] = {"net_arch": list(content.layers)}
    if content.correction is not None:
        policy, policy_settings["correction"] = CorrectingPolicy, content.correction
    try:
        with warnings.catch_warnings():  # about sizes of batches, of a learner that never learns
            warnings.simplefilter("ignore")
            model = ALGORITHMS[content.algorithm](
                policy,
                where,
                device="cpu",
                policy_kwargs=policy_settings,
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
    """Have the spaces and the task of an environment and nothing else: nobody steps it."""

    def __init__(self, content: PolicyFile) -> None:
        self.observation_space = content.observation_space
        self.action_space = content.action_space
        self.task = content.task


def make_policy(model: BaseAlgorithm) -> Callable[[Any], Any]:
    """Return the deterministic policy: observation (5,) to action (1,) within +-1, or an index."""
    return lambda observation: model.predict(observation, deterministic=True)[0]


def prepare_env(env: gym.Env[Any, Any], model: BaseAlgorithm) -> gym.Env[Any, Any]:
    """Return the environment as the policy expects it: with the controller that it corrects.

    Raises BadInputError when the observations are not the policy's, or its commands would be
    scaled to another size.
    """
    task, correction = get_task(model), get_correction(model)
    limit = env.unwrapped.task.pwm_limit  # type: ignore[attr-defined]
    if task is not None and not np.isclose(limit, task.pwm_limit):
        raise BadInputError(
            f"expected an environment whose commands go up to {task.pwm_limit:g}, as in the "
            f"policy's training, found {limit:g}: give pwm_limit={task.pwm_limit:g}"
        )
    if correction is not None:
        return CorrectedEnv(env, correction)
    if model.observation_space.shape != env.observation_space.shape:
        raise BadInputError(
            f"expected a policy for observations {env.observation_space.shape}, found "
            f"{model.observation_space.shape}"
        )
    return env


class PolicyController:
    """Give a command for a measured state by a learned policy; `reset` before each episode.

    model: the learner.
    task: its task, whose limit is the size of an action of 1.
    """

    def __init__(self, model: BaseAlgorithm, task: Task) -> None:
        if model.observation_space.shape != (5,):
            raise BadInputError(
                f"expected a policy for observations (5,), found {model.observation_space.shape}"
            )
        self._choose, self._task = make_policy(model), task

    def reset(self) -> None:
        """Begin an episode: the policy remembers nothing."""

    def __call__(self, measured: Floats) -> float:
        """Return the PWM fraction to hold until the next sample; measured: (4,) x, th, v, w."""
        action = self._choose(make_observation(measured, self._task))
        return self._task.pwm_limit * float(np.clip(action[0], -1.0, 1.0))


class CorrectingController:
    """Give a PWM fraction for a measured state by a controller and its learned correction.

    model: the learner.
    correction: what it corrects.
    """

    def __init__(self, model: BaseAlgorithm, correction: Correction) -> None:
        self._choose, self._corrector = make_policy(model), Corrector(correction, 1)
        self.reset()

    def reset(self) -> None:
        """Begin an episode."""
        self._has_begun = False

    def __call__(self, measured: Floats) -> float:
        """Return the PWM fraction to hold until the next sample; measured: (4,) x, th, v, w."""
        if self._has_begun:
            self._corrector.follow([0], measured[None])
        else:
            self._corrector.begin([0], measured[None])
        self._has_begun = True
        action = self._choose(self._corrector.show()[0])
        return float(self._corrector.choose_commands(action)[0])


def load_controller(path: Path, task: Task) -> PolicyController | CorrectingController:
    """Return the policy in a file that `train` has written, as a controller.

    task: of a policy whose file does not say how large its commands are.
    """
    model = load_policy(path)
    correction = get_correction(model)
    if correction is None:
        return PolicyController(model, get_task(model) or task)
    return CorrectingController(model, correction)
