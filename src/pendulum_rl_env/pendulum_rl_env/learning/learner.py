"""Make a new learner from a preset."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
from stable_baselines3.common.vec_env import VecEnv

from pendulum_rl_env.learning.algorithms import ALGORITHMS
from pendulum_rl_env.learning.preset import Preset
from pendulum_twin.errors import BadInputError


def make_learner(preset: Preset, env: VecEnv, seed: int, logs: Path | None) -> BaseAlgorithm:
    """Return a new learner.

    preset: algorithm, layers and settings.
    env: where it learns.
    seed: of its weights and its exploration.
    logs: folder for TensorBoard; None for no logs.

    Raises BadInputError when the algorithm refuses a setting or the environment.
    """
    torch.set_num_threads(1)  # networks of 64 units are too small to share
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


def as_off_policy(model: BaseAlgorithm) -> OffPolicyAlgorithm | None:
    """Return the learner when it replays old steps, else None."""
    return model if isinstance(model, OffPolicyAlgorithm) else None


def _make_falling_rate(rate: float) -> Callable[[float], float]:
    """Return a learning rate that falls to 0, as a function of the share of training left."""
    return lambda left: rate * left
