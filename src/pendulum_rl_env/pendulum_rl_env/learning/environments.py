"""Where `train` learns and where it evaluates, by its options and its preset."""

from __future__ import annotations

import argparse
from collections.abc import Callable

import gymnasium as gym
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import DummyVecEnv, VecEnv

from pendulum_rl_env.fleet import Fleet
from pendulum_rl_env.in_process import load_learnable_twin
from pendulum_rl_env.learning.fleet_vec_env import FleetVecEnv
from pendulum_rl_env.learning.history_vec_env import HistoryVecEnv
from pendulum_rl_env.learning.preset import IN_PROCESS, OVER_TOPICS, Preset
from pendulum_rl_env.posterior import Knowledge, gather_knowledge
from pendulum_rl_env.task import Task

EVALUATION_EPISODES = 20
EVALUATION_SEED_OFFSET = 10**6  # from the seed of the training to that of the evaluation


def make_environments(options: argparse.Namespace, preset: Preset) -> tuple[VecEnv, VecEnv]:
    """Return where to learn and where to evaluate, with the history that the preset asks for."""
    training, evaluation = _make_plain_environments(options, preset)
    if not preset.history:
        return training, evaluation
    shown = HistoryVecEnv(training, preset.history)
    return shown, shown if evaluation is training else HistoryVecEnv(evaluation, preset.history)


def _make_plain_environments(options: argparse.Namespace, preset: Preset) -> tuple[VecEnv, VecEnv]:
    """Return where to learn and where to evaluate: two fleets, or twice the one rig."""
    if options.rig is not None:
        topics = {"namespace": options.rig, "step_s": options.step_s}
        rig = DummyVecEnv([lambda: Monitor(gym.make(OVER_TOPICS, **topics))])
        return rig, rig
    if options.env != IN_PROCESS:
        make: list[Callable[[], gym.Env]] = [lambda: Monitor(gym.make(options.env))]
        training, evaluation = DummyVecEnv(make * preset.environments), DummyVecEnv(make)
        training.seed(options.seed)
        evaluation.seed(options.seed + EVALUATION_SEED_OFFSET)
        return training, evaluation
    knowledge = gather_training_knowledge(options)
    task, encoders = Task.make_for_step(options.step_s), knowledge.encoders
    count, spread = preset.environments, preset.start_spread
    fleet = Fleet(knowledge.twins, count, task, encoders, spread, options.seed)
    best = Fleet(knowledge.twins[:1], EVALUATION_EPISODES, task, encoders, 0.0, options.seed)
    return FleetVecEnv(fleet), FleetVecEnv(best)


def gather_training_knowledge(options: argparse.Namespace) -> Knowledge:
    """Return the twins and encoders that the options of `train` leave possible."""
    twin = load_learnable_twin(options.twin)
    return gather_knowledge(twin, options.verdict, options.draws, options.seed)
