"""Train on a concealed rig, stepped directly: a policy of its twin, carefully and briefly, or one from nothing."""

from __future__ import annotations

import time
from pathlib import Path

import gymnasium as gym
from stable_baselines3 import PPO
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import DummyVecEnv

from pendulum_rl_env.in_process import scaled
from pendulum_rl_env.learning.algorithms import learner, load_policy, policy_of
from pendulum_rl_env.learning.callbacks import Progress
from pendulum_rl_env.learning.on_rig import learn_on_rig
from pendulum_rl_env.learning.preset import IN_PROCESS, load_preset
from pendulum_rl_env.learning.result import GOOD, Result
from pendulum_rl_env.scoring import run_episode
from pendulum_rl_env.stages import ConcealedRig
from pendulum_rl_env.task import Task
from pendulum_twin.errors import BadInputError

# Small steps: what was learned in the twin is nearly right, and a few thousand steps on the rig
# are few to learn it anew.
ROLLOUT = 2048  # steps
SETTINGS = {
    "learning_rate": 1e-4,
    "n_steps": ROLLOUT,
    "batch_size": 256,
    "n_epochs": 10,
    "clip_range": 0.1,
}
CALM = -2.0  # log of the deviation of the tried actions, of full PWM


def fine_tuned(policy: Path, rig: ConcealedRig, steps: int, out: Path) -> float:
    """Train a policy of PPO on the rig for at most so many steps; keep the best on the way, and return its reward.

    It is looked at before and after every 2,048 steps. Rollouts count as steps on the rig,
    evaluations do not.
    """
    before = load_policy(policy)
    if not isinstance(before, PPO):
        raise BadInputError(
            f"{policy}: expected a policy of PPO to fine-tune, found one of {type(before).__name__}"
        )
    training, evaluation = DummyVecEnv([lambda: _env(rig)]), _env(rig)
    try:
        model = PPO.load(policy, training, device="cpu", custom_objects=SETTINGS)
        model.policy.log_std.data.clamp_(max=CALM)
        best = run_episode(evaluation, policy_of(model)).reward
        out.mkdir(parents=True, exist_ok=True)
        model.save(out / "policy.zip")
        for done in range(0, steps - ROLLOUT + 1, ROLLOUT):
            model.learn(ROLLOUT, reset_num_timesteps=done == 0)
            earned = run_episode(evaluation, policy_of(model)).reward
            if earned > best:
                best = earned
                model.save(out / "policy.zip")
    finally:
        training.close()
        evaluation.close()
    return best


def from_scratch(rig: ConcealedRig, seed: int, steps: int, out: Path) -> float:
    """Learn on the rig alone, by the preset for that, until GOOD or at most so many steps; return the best mean reward."""
    preset = load_preset("frugal", IN_PROCESS)
    env = DummyVecEnv([lambda: _env(rig)])
    out.mkdir(parents=True, exist_ok=True)
    begun_s = time.monotonic()
    result = Result(IN_PROCESS, "frugal", preset.algorithm, seed)
    try:
        model = learner(preset, env, seed, None)
        silent = Progress(steps, lambda line: None)
        learn_on_rig(
            model,
            steps,
            preset.evaluate_every,
            1,
            result,
            out,
            GOOD,
            lambda: time.monotonic() - begun_s,
            silent,
        )
    finally:
        env.close()
    return result.best_mean_reward or 0.0


def _env(rig: ConcealedRig) -> gym.Env:
    task = Task()
    return Monitor(gym.wrappers.TimeLimit(scaled(rig.env(task)), task.steps))
