"""Where `train` learns and where it evaluates, by its options and its preset."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import replace

import gymnasium as gym
import numpy as np
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import DummyVecEnv, VecEnv

from pendulum_rl_env.command_limits import check_limits
from pendulum_rl_env.control.design import TYPICAL_ENCODERS, perturb_twin
from pendulum_rl_env.correction import Correction
from pendulum_rl_env.fleet import Fleet
from pendulum_rl_env.in_process import load_learnable_twin
from pendulum_rl_env.learning.corrected_vec_env import CorrectedVecEnv
from pendulum_rl_env.learning.fleet_vec_env import FleetVecEnv
from pendulum_rl_env.learning.preset import IN_PROCESS, OVER_TOPICS, Preset
from pendulum_rl_env.posterior import Knowledge, gather_knowledge
from pendulum_rl_env.task import Task
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin

EVALUATION_EPISODES = 20
EVALUATION_SEED_OFFSET = 10**6  # from the seed of the training to that of the evaluation

PERTURBED_TWINS = 64  # on which corrections are learned
DRIVE_ERROR, INERTIA_ERROR = 0.05, 0.03  # at most, of these twins, as of `design.PERTURBATIONS`
REWARD_AT_REST = 1.0  # of a step upright at rest in the middle


def make_environments(
    options: argparse.Namespace,
    preset: Preset,
    correction: Correction | None = None,
    pwm_limit: float | None = None,
) -> tuple[VecEnv, VecEnv]:
    """Return where to learn and where to evaluate: two fleets, or twice the one rig.

    correction: what the policy corrects; None when the command is all its own.
    pwm_limit: largest command of the policy that training begins with; None for the twin's.

    Raises BadInputError when the policy's commands have another unit than those of twin or rig.
    """
    if correction is not None:
        return _make_corrected_environments(options, preset, correction)
    if options.rig is not None:
        if pwm_limit is None and options.twin is not None:
            pwm_limit = Task().allow_commands(load_learnable_twin(options.twin).rig).pwm_limit
        topics = {
            "namespace": options.rig,
            "step_s": options.step_s,
            "pwm_limit": pwm_limit,
            "max_episode_steps": Task.make_for_step(options.step_s).steps,
        }
        rig = DummyVecEnv([lambda: Monitor(gym.make(OVER_TOPICS, **topics))])
        return rig, rig
    if options.env != IN_PROCESS:
        make: list[Callable[[], gym.Env]] = [lambda: Monitor(gym.make(options.env))]
        training, evaluation = DummyVecEnv(make * preset.environments), DummyVecEnv(make)
        training.seed(options.seed)
        evaluation.seed(options.seed + EVALUATION_SEED_OFFSET)
        return training, evaluation
    knowledge = gather_training_knowledge(options)
    task, encoders = _make_task(options, knowledge, pwm_limit), knowledge.encoders
    count, spread = preset.environments, preset.start_spread
    short = replace(task, steps=preset.episode_steps or task.steps)
    fleet = Fleet(knowledge.twins, count, short, encoders, spread, options.seed)
    best = Fleet(knowledge.twins[:1], EVALUATION_EPISODES, task, encoders, 0.0, options.seed)
    return FleetVecEnv(fleet), FleetVecEnv(best)


def _make_corrected_environments(
    options: argparse.Namespace, preset: Preset, correction: Correction
) -> tuple[VecEnv, VecEnv]:
    """Return fleets of twins that are not quite the twin, always the same at an evaluation."""
    knowledge = gather_training_knowledge(options)
    encoders = TYPICAL_ENCODERS if options.verdict is None else knowledge.encoders
    twins = _perturb_twins(knowledge.twins, PERTURBED_TWINS, options.seed)
    other_seed = options.seed + EVALUATION_SEED_OFFSET
    others = _perturb_twins(knowledge.twins, EVALUATION_EPISODES, other_seed)
    task = _make_task(options, knowledge, correction.base.task.pwm_limit)
    short = replace(task, steps=preset.episode_steps or task.steps)
    spread = preset.start_spread
    fleet = Fleet(twins, preset.environments, short, encoders, spread, options.seed)
    best = Fleet(others, EVALUATION_EPISODES, task, encoders, 0.0, other_seed)
    return (
        CorrectedVecEnv(FleetVecEnv(fleet), correction, deduction=REWARD_AT_REST),
        CorrectedVecEnv(FleetVecEnv(best), correction, fixed_seed=other_seed),
    )


def _make_task(
    options: argparse.Namespace, knowledge: Knowledge, pwm_limit: float | None = None
) -> Task:
    twin = knowledge.twins[0]
    if pwm_limit is not None:
        check_limits(pwm_limit, twin.rig.pwm_limit, twin.name)
    return Task.make_for_step(options.step_s).allow_commands(twin.rig).take_limit(pwm_limit)


def _perturb_twins(twins: Sequence[Twin], count: int, seed: int) -> list[Twin]:
    """Return so many twins whose drive and inertia are a little off, in turn of those given."""
    random = np.random.default_rng(seed)
    perturbed = []
    for number in range(count):
        twin = twins[number % len(twins)]
        force = 1.0 + DRIVE_ERROR * random.uniform(-1.0, 1.0)
        inertia = 1.0 + INERTIA_ERROR * random.uniform(-1.0, 1.0)
        try:
            perturbed.append(perturb_twin(twin, force, inertia))
        except BadInputError:  # no bodies have this inertia together
            perturbed.append(perturb_twin(twin, force, 1.0))
    return perturbed


def gather_training_knowledge(options: argparse.Namespace) -> Knowledge:
    """Return the twins and encoders that the options of `train` leave possible."""
    twin = load_learnable_twin(options.twin)
    return gather_knowledge(twin, options.verdict, options.draws, options.seed)
