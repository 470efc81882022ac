"""Load what `train` has written, and use it as a policy."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any
from zipfile import BadZipFile, ZipFile

import torch
from stable_baselines3.common.base_class import BaseAlgorithm

from pendulum_rl_env.learning.algorithms import ALGORITHMS
from pendulum_twin.errors import BadInputError

BY_MODULE = {  # files name the module of the policy's class, not the algorithm
    algorithm.policy_aliases["MlpPolicy"].__module__: algorithm
    for algorithm in ALGORITHMS.values()
}


def load_policy(path: str | Path) -> BaseAlgorithm:
    """Return the learner in a file that `train` wrote; raise BadInputError for any other file."""
    torch.set_num_threads(1)
    file = Path(path)
    if not file.is_file():
        raise BadInputError(f"{path}: expected a policy that `train` has written, found no file")
    try:
        with ZipFile(file) as archive:
            module = json.loads(archive.read("data"))["policy_class"]["__module__"]
        return BY_MODULE[module].load(file, device="cpu")
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


def make_policy(model: BaseAlgorithm) -> Callable[[Any], Any]:
    """Return the deterministic policy: observation (5,) to action (1,) within +-1, or an index."""
    return lambda observation: model.predict(observation, deterministic=True)[0]
