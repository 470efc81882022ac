"""Learn on the one rig there is: training and evaluation take turns, each from a reset."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback, CallbackList
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.vec_env import VecEnv

from pendulum_rl_env.learning.callbacks import CHECKPOINT_STEPS, Checkpoints, note_evaluation
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
    """Train and evaluate in turns on the learner's own environment.

    An evaluation amid an episode would leave the learner with the observation of a pendulum that
    has moved since; so every turn begins with a reset.

    model: learns.
    total: timesteps at most.
    every: timesteps from evaluation to evaluation.
    episodes: of an evaluation.
    result: takes the evaluations.
    out: folder of policy, result and checkpoints.
    until: mean reward that ends the training; None for none.
    clock: s since the start of the program.
    progress: called at every step.
    """
    env = model.get_env()
    assert env is not None
    checkpoints = Checkpoints(CHECKPOINT_STEPS, out)
    while model.num_timesteps < total:
        model._last_obs = None  # so that learning begins with a reset
        model.learn(
            min(every, total - model.num_timesteps),
            callback=CallbackList([checkpoints, progress]),
            tb_log_name="run",
            reset_num_timesteps=model.num_timesteps == 0,
        )
        mean = evaluate_mean_reward(model, env, episodes)
        note_evaluation(model, mean, result, out, clock())
        if until is not None and mean >= until:
            return
