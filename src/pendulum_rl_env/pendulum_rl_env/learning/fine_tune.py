"""Go on training a policy on the rig, carefully and briefly."""

from __future__ import annotations

from pathlib import Path

import gymnasium as gym
from stable_baselines3 import PPO
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import DummyVecEnv

from pendulum_rl_env.in_process import scaled
from pendulum_rl_env.learning.algorithms import load_policy, policy_of
from pendulum_rl_env.scoring import run_episode
from pendulum_rl_env.stages import ConcealedRig
from pendulum_rl_env.task import Task
from pendulum_twin.errors import BadInputError

# Small steps: what was learned in the twin is nearly right, and a few thousand steps on the rig are few to learn it anew.
ROLLOUT = 2048  # steps
SETTINGS = {"learning_rate": 1e-4, "n_steps": ROLLOUT, "batch_size": 256, "n_epochs": 10, "clip_range": 0.1}
CALM = -2.0  # log of the deviation of the tried actions, of full PWM


def fine_tuned(policy: Path, rig: ConcealedRig, steps: int, out: Path) -> float:
    """Train a policy of PPO on the rig for at most so many steps; keep the best on the way, and return its reward.

    It is looked at before and after every 2,048 steps. Rollouts count as steps on the rig, evaluations do not.
    """
    before = load_policy(policy)
    if not isinstance(before, PPO):
        raise BadInputError(f"{policy}: expected a policy of PPO to fine-tune, found one of {type(before).__name__}")
    task = Task()

    def env() -> gym.Env:
        return Monitor(gym.wrappers.TimeLimit(scaled(rig.env(task)), task.steps))

    training, evaluation = DummyVecEnv([env]), env()
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
