"""Train on a concealed rig, stepped directly: fine-tune a twin's policy, or learn from nothing."""

from __future__ import annotations

import time
from pathlib import Path

import gymnasium as gym
from stable_baselines3 import PPO
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import DummyVecEnv

from pendulum_rl_env.in_process import scale_actions
from pendulum_rl_env.learning.callbacks import Progress
from pendulum_rl_env.learning.learner import make_learner
from pendulum_rl_env.learning.on_rig import learn_on_rig
from pendulum_rl_env.learning.policies import (
    get_task,
    load_policy,
    make_policy,
    prepare_env,
    save_policy,
)
from pendulum_rl_env.learning.preset import IN_PROCESS, load_preset
from pendulum_rl_env.learning.result import SOLVED_MEAN_REWARD, Result
from pendulum_rl_env.scoring import run_episode
from pendulum_rl_env.studies.stages import ConcealedRig
from pendulum_rl_env.task import Task
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import load_twin

ROLLOUT_STEPS = 2048  # on the rig, between two updates of the policy
# Small updates: the twin's policy is nearly right, and a few thousand steps on the rig are too few
# to learn it anew.
SETTINGS = {
    "learning_rate": 1e-4,
    "n_steps": ROLLOUT_STEPS,
    "batch_size": 256,
    "n_epochs": 10,
    "clip_range": 0.1,
    "seed": 0,
}
MOST_LOG_STD = -2.0  # of the explored actions, in units of full PWM


def fine_tune(policy: Path, rig: ConcealedRig, steps: int, out: Path) -> float:
    """Train a policy of PPO on the rig, keep the best on the way, and return its reward.

    policy: file of the policy to begin with.
    rig: where it is trained, and evaluated before and after every 2,048 steps.
    steps: on the rig, at most; evaluations do not count.
    out: folder of the best policy.

    Raises BadInputError when the policy is none of PPO.
    """
    before = load_policy(policy)
    if not isinstance(before, PPO):
        raise BadInputError(
            f"{policy}: expected a policy of PPO to fine-tune, found one of "
            f"{type(before).__name__}"
        )
    task = get_task(before) or Task()
    training = DummyVecEnv([lambda: prepare_env(_make_env(rig, task), before)])
    evaluation = prepare_env(_make_env(rig, task), before)
    try:
        model = load_policy(policy, env=training, settings=SETTINGS)
        assert isinstance(model, PPO)
        model.policy.log_std.data.clamp_(max=MOST_LOG_STD)
        best = run_episode(evaluation, make_policy(model)).reward
        out.mkdir(parents=True, exist_ok=True)
        save_policy(model, out / "policy.zip")
        for done in range(0, steps - ROLLOUT_STEPS + 1, ROLLOUT_STEPS):
            model.learn(ROLLOUT_STEPS, reset_num_timesteps=done == 0)
            reward = run_episode(evaluation, make_policy(model)).reward
            if reward > best:
                best = reward
                save_policy(model, out / "policy.zip")
    finally:
        training.close()
        evaluation.close()
    return best


def learn_from_scratch(rig: ConcealedRig, seed: int, steps: int, out: Path) -> float:
    """Learn on the rig alone by the preset frugal, and return the best mean reward.

    rig: where it is trained and evaluated.
    seed: of the training.
    steps: on the rig, at most; a mean reward of 400 ends it earlier.
    out: folder of policy, result and checkpoints.
    """
    preset = load_preset("frugal", IN_PROCESS)
    task = Task().allow_commands(load_twin(rig.nominal).rig)
    env = DummyVecEnv([lambda: _make_env(rig, task)])
    out.mkdir(parents=True, exist_ok=True)
    start_s = time.monotonic()
    result = Result(IN_PROCESS, "frugal", preset.algorithm, seed)
    try:
        learn_on_rig(
            make_learner(preset, env, seed, None),
            steps,
            preset.evaluate_every,
            1,
            result,
            out,
            SOLVED_MEAN_REWARD,
            lambda: time.monotonic() - start_s,
            Progress(steps, lambda line: None),
        )
    finally:
        env.close()
    return result.best_mean_reward or 0.0


def _make_env(rig: ConcealedRig, task: Task) -> gym.Env:
    return Monitor(gym.wrappers.TimeLimit(scale_actions(rig.make_env(task)), task.steps))
