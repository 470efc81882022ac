"""Learn on the one rig that there is: training and evaluation take turns, each from a reset of its own."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback, CallbackList, CheckpointCallback
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.vec_env import VecEnv

from pendulum_rl_env.learning.callbacks import CHECKPOINT_STEPS, note_evaluation
from pendulum_rl_env.learning.result import Result


def evaluate_mean_reward(model: BaseAlgorithm, env: VecEnv, episodes: int) -> float:
    """Return the mean reward of so many episodes without exploration."""
    mean, _ = evaluate_policy(model, env, episodes, deterministic=True, warn=False)
    assert isinstance(mean, float | np.floating)
    return float(mean)


def learn_on_rig(
    model: BaseAlgorithm,
    total: int,
    every: int,
    episodes: int,
    result: Result,
    out: Path,
    until: float | None,
    clock: Callable[[], float],
    progress: BaseCallback,
) -> None:
    """Train until so many steps, or a mean reward of `until`; after each `every` steps evaluate so many episodes.

    An evaluation in the middle of an episode would leave the learner with an observation of a
    pendulum that has moved since.
    """
    env = model.get_env()
    assert env is not None
    keeping = CallbackList(
        [CheckpointCallback(CHECKPOINT_STEPS, str(out / "checkpoints"), "policy"), progress]
    )
    while model.num_timesteps < total:
        steps = min(every, total - model.num_timesteps)
        model._last_obs = None  # so that learning begins with a reset
        model.learn(
            steps,
            callback=keeping,
            tb_log_name="run",
            reset_num_timesteps=model.num_timesteps == 0,
        )
        mean = evaluate_mean_reward(model, env, episodes)
        note_evaluation(model, mean, result, out, clock())
        if until is not None and mean >= until:
            return
