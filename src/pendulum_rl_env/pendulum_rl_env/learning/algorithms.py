"""The learners by name, made and loaded alike."""

from __future__ import annotations

import inspect
import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any
from zipfile import BadZipFile, ZipFile

import torch
from sb3_contrib import TQC, CrossQ
from stable_baselines3 import DQN, PPO, SAC
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
from stable_baselines3.common.vec_env import VecEnv

from pendulum_twin.errors import BadInputError

if TYPE_CHECKING:
    from pendulum_rl_env.learning.preset import Preset

ALGORITHMS: dict[str, type[BaseAlgorithm]] = {
    "ppo": PPO,
    "sac": SAC,
    "tqc": TQC,
    "crossq": CrossQ,
    "dqn": DQN,
}
BY_MODULE = {
    kind.policy_aliases["MlpPolicy"].__module__: kind for kind in ALGORITHMS.values()
}  # as their files tell it
SETTINGS_OF_PRESET = {
    "policy",
    "env",
    "seed",
    "device",
    "learning_rate",
    "policy_kwargs",
    "tensorboard_log",
    "verbose",
    "self",
}


def list_settings(algorithm: str) -> set[str]:
    """Return which further settings a learner takes."""
    return set(inspect.signature(ALGORITHMS[algorithm].__init__).parameters) - SETTINGS_OF_PRESET


def make_learner(preset: Preset, env: VecEnv, seed: int, logs: Path | None) -> BaseAlgorithm:
    """Return a new learner; raise BadInputError when it does not take a setting, or not this environment."""
    torch.set_num_threads(1)  # networks of 64 are too small to share
    rate = preset.learning_rate
    try:
        return ALGORITHMS[preset.algorithm](
            "MlpPolicy",
            env,
            learning_rate=_make_falling_rate(rate) if preset.falling else rate,
            seed=seed,
            device="cpu",
            policy_kwargs={"net_arch": list(preset.layers)},
            tensorboard_log=None if logs is None else str(logs),
            **preset.settings,
        )
    except (AssertionError, TypeError, ValueError) as error:
        raise BadInputError(
            f"{preset.algorithm}: expected settings that it can learn with here, found: {error}"
        ) from error


def _make_falling_rate(rate: float) -> Callable[[float], float]:
    return lambda left: rate * left


def load_policy(path: str | Path) -> BaseAlgorithm:
    """Return what was learned, from the file that `train` wrote; raise BadInputError when it is none."""
    torch.set_num_threads(1)
    found = Path(path)
    if not found.is_file():
        raise BadInputError(f"{path}: expected a policy that `train` has written, found no file")
    try:
        with ZipFile(found) as packed:
            module = json.loads(packed.read("data"))["policy_class"]["__module__"]
        return BY_MODULE[module].load(found, device="cpu")
    except (
        BadZipFile,
        ValueError,
        OSError,
        EOFError,
        KeyError,
        TypeError,
        RuntimeError,
        AttributeError,
    ) as error:
        raise BadInputError(
            f"{path}: expected a policy that `train` has written, found none in it ({error})"
        ) from error


def as_off_policy(model: BaseAlgorithm) -> OffPolicyAlgorithm | None:
    """Return the learner when it is one that remembers old steps."""
    return model if isinstance(model, OffPolicyAlgorithm) else None


def make_policy(model: BaseAlgorithm) -> Callable[[Any], Any]:
    """Return the deterministic policy: observation (5,) -> action (1,) from -1 to 1, or an index."""
    return lambda seen: model.predict(seen, deterministic=True)[0]
