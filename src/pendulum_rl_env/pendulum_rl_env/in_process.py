"""The registered environments that run in this process."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

from pendulum_rl_env.command_limits import check_limits
from pendulum_rl_env.env import PendulumEnv
from pendulum_rl_env.fleet import Fleet
from pendulum_rl_env.kernel_transport import KernelTransport
from pendulum_rl_env.task import Task
from pendulum_rl_env.vector_env import PendulumVectorEnv
from pendulum_twin.encoders import EXACT, Encoders
from pendulum_twin.errors import BadInputError
from pendulum_twin.inteco import load_twin_or_inteco
from pendulum_twin.model import Twin

TwinLike = Twin | str | Path | None


def load_learnable_twin(twin: TwinLike) -> Twin:
    """Return a twin to learn on.

    twin: the twin itself, its file, or None for the INTECO rig.

    Raises BadInputError when the file cannot be read, or cart, pole or drive is missing.
    """
    loaded = twin if isinstance(twin, Twin) else load_twin_or_inteco(twin)
    if not (loaded.rig.has_cart and loaded.rig.has_pole and loaded.rig.force_per_pwm_n):
        raise BadInputError(
            f"{loaded.name}: expected a rig with cart, pole and drive to learn on, found a part "
            "missing"
        )
    return loaded


def scale_actions(env: gym.Env[Any, Any]) -> gym.Env[Any, Any]:
    """Return the environment with actions from -1 to 1, as learners want; 1 is the PWM limit."""
    return gym.wrappers.RescaleAction(env, np.float32(-1), np.float32(1))


def make_twin_env(
    twin: TwinLike = None,
    step_s: float = 0.03,
    encoders: Encoders = EXACT,
    render_mode: str | None = None,
    pwm_limit: float | None = None,
) -> gym.Env[Any, Any]:
    """Return `InvertedPendulum-v0`: a twin in this process.

    twin: see `load_learnable_twin`.
    step_s: s; from command to command.
    encoders: how finely positions are measured.
    render_mode: "rgb_array" for pictures, "human" for a window.
    pwm_limit: largest command of the policy that is to play; None for the task's own.

    The caller limits the length of episodes. `gymnasium.make` does so after 512 steps whatever
    step_s is: with another than 0.03 s give it max_episode_steps=Task.make_for_step(step_s).steps.

    Raises BadInputError when the twin's own limit is of another unit, see `check_limits`.
    """
    loaded = load_learnable_twin(twin)
    task = _make_task(loaded, step_s, pwm_limit)
    transport = KernelTransport(loaded, step_s, encoders)
    return scale_actions(PendulumEnv(transport, task, render_mode))


def make_twin_vector_env(
    num_envs: int = 16,
    twin: TwinLike = None,
    step_s: float = 0.03,
    encoders: Encoders = EXACT,
    spread: float = 0.0,
    render_mode: str | None = None,
    pwm_limit: float | None = None,
    max_episode_steps: int | None = None,
) -> PendulumVectorEnv:
    """Return `InvertedPendulum-v0` many times, for `gymnasium.make_vec`.

    num_envs: how many pendulums.
    spread: share of episodes that begin anywhere, see `Fleet`.
    render_mode: None, for there are no pictures of many pendulums.
    max_episode_steps: length of an episode; None for the task's own number of seconds.
        `gymnasium.make_vec` gives 512 where it gets none.
    Other arguments: see `make_twin_env`.

    Raises BadInputError for a render mode, and as `make_twin_env` does.
    """
    if render_mode is not None:
        raise BadInputError(
            "render_mode: expected None for many pendulums in one call, found "
            f"{render_mode!r}: make one with gymnasium.make, or give make_vec "
            "vectorization_mode='sync'"
        )
    loaded = load_learnable_twin(twin)
    task = _make_task(loaded, step_s, pwm_limit)
    if max_episode_steps is not None:
        task = replace(task, steps=max_episode_steps)
    return PendulumVectorEnv(Fleet([loaded], num_envs, task, encoders, spread))


def _make_task(twin: Twin, step_s: float, pwm_limit: float | None) -> Task:
    """Return the task in a twin, for a policy whose largest command is known or not."""
    if pwm_limit is not None:
        check_limits(pwm_limit, twin.rig.pwm_limit, twin.name)
    return Task.make_for_step(step_s).allow_commands(twin.rig).take_limit(pwm_limit)
