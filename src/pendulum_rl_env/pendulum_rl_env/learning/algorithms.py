"""The learning algorithms by name."""

from __future__ import annotations

import inspect

from sb3_contrib import TQC, CrossQ
from stable_baselines3 import DQN, PPO, SAC
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.logger import Logger

ALGORITHMS: dict[str, type[BaseAlgorithm]] = {
    "ppo": PPO,
    "sac": SAC,
    "tqc": TQC,
    "crossq": CrossQ,
    "dqn": DQN,
}
# What `make_learner` says itself, so that a preset's settings may not.
SET_BY_LEARNER = {
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


def discard_log(model: BaseAlgorithm) -> None:
    """Let a learner log nowhere; by itself it would leave an empty folder in the system's."""
    model.set_logger(Logger(folder=None, output_formats=[]))


def list_settings(algorithm: str) -> set[str]:
    """Return the names of the settings that a preset may give an algorithm."""
    return set(inspect.signature(ALGORITHMS[algorithm].__init__).parameters) - SET_BY_LEARNER
