"""Make a new learner from a preset."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
from stable_baselines3.common.vec_env import VecEnv

from pendulum_rl_env.correction import Correction
from pendulum_rl_env.learning.algorithms import ALGORITHMS, discard_log
from pendulum_rl_env.learning.correcting_policy import CorrectingPolicy
from pendulum_rl_env.learning.preset import Preset
from pendulum_twin.errors import BadInputError


def make_learner(
    preset: Preset,
    env: VecEnv,
    seed: int,
    logs: Path | None,
    correction: Correction | None = None,
) -> BaseAlgorithm:
    """Return a new learner.

    preset: algorithm, layers and settings.
    env: where it learns.
    seed: of its weights and its exploration.
    logs: folder for TensorBoard; None for no logs.
    correction: what the policy corrects; None when the command is all its own.

    Raises BadInputError when the algorithm refuses a setting or the environment.
    """
    torch.set_num_threads(1)  # networks of 64 units are too small to share
    rate = preset.learning_rate
    policy: str | type[CorrectingPolicy] = "MlpPolicy"
    policy_settings: dict[str, Any] = {"net_arch": list(preset.layers)}
    if correction is not None:
        policy, policy_settings["correction"] = CorrectingPolicy, correction
    try:
        learner = ALGORITHMS[preset.algorithm](
            policy,
            env,
            learning_rate=_make_falling_rate(rate) if preset.falling else rate,
            seed=seed,
            device="cpu",
            policy_kwargs=policy_settings,
            tensorboard_log=None if logs is None else str(logs),
            **preset.settings,
        )
    except (AssertionError, TypeError, ValueError) as error:
        raise BadInputError(
            f"{preset.algorithm}: expected settings that it can learn with here, found: {error}"
        ) from error
    if logs is None:
        discard_log(learner)
    return learner


def as_off_policy(model: BaseAlgorithm) -> OffPolicyAlgorithm | None:
    """Return the learner when it replays old steps, else None."""
    return model if isinstance(model, OffPolicyAlgorithm) else None


def explore_by_policy(model: OffPolicyAlgorithm) -> None:
    """Let a learner that begins with a policy explore by it from the first step on.

    Until its first update, 1500 steps in the preset `frugal`, the library would act at random.
    """
    sample = model._sample_action
    model._sample_action = (  # type: ignore[method-assign]
        lambda learning_starts, *more: sample(0, *more)
    )


def _make_falling_rate(rate: float) -> Callable[[float], float]:
    """Return a learning rate that falls to 0, as a function of the share of training left."""
    return lambda left: rate * left
