"""The registered environments that run in this process."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

from pendulum_rl_env.env import PendulumEnv
from pendulum_rl_env.fleet import Fleet
from pendulum_rl_env.kernel_transport import KernelTransport
from pendulum_rl_env.task import Task
from pendulum_rl_env.vector_env import PendulumVectorEnv
from pendulum_twin.encoders import EXACT, Encoders
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin, load_twin
from pendulum_twin.rig import Rig

# The INTECO rig by its maker's constants, as in config/inteco.yaml: what is learned on when no
# twin is given.
INTECO = Twin("inteco", Rig(
    cart_mass_kg=0.5723, pole_mass_kg=0.12, com_distance_m=0.01955717, pole_inertia_kg_m2=0.00292, gravity_m_s2=9.81,
    force_per_pwm_n=12.86, cart_viscous_n_s_m=0.5, pole_viscous_n_m_s=0.00027344, rail_half_length_m=0.9, pwm_limit=0.5,
))  # fmt: skip

TwinLike = Twin | str | Path | None


def load_learnable_twin(twin: TwinLike) -> Twin:
    """Return the twin, or that of a file, or the INTECO rig; raise BadInputError when it cannot be learned on."""
    found = INTECO if twin is None else twin if isinstance(twin, Twin) else load_twin(twin)
    if not (found.rig.has_cart and found.rig.has_pole and found.rig.force_per_pwm_n):
        raise BadInputError(
            f"{found.name}: expected a rig with cart, pole and drive to learn on, found a part missing"
        )
    return found


def scale_actions(env: gym.Env[Any, Any]) -> gym.Env[Any, Any]:
    """Return the environment with actions from -1 to 1, as learners want them: 1 is the largest PWM."""
    return gym.wrappers.RescaleAction(env, np.float32(-1), np.float32(1))


def make_twin_env(
    twin: TwinLike = None,
    step_s: float = 0.03,
    encoders: Encoders = EXACT,
    render_mode: str | None = None,
) -> gym.Env[Any, Any]:
    """Return `InvertedPendulum-v0`: a twin (a Twin, a twin file or, without one, the INTECO rig) in this process."""
    transport = KernelTransport(load_learnable_twin(twin), step_s, encoders)
    return scale_actions(PendulumEnv(transport, Task(step_s=step_s), render_mode))


def make_twin_vector_env(
    num_envs: int = 16, twin: TwinLike = None, step_s: float = 0.03, encoders: Encoders = EXACT, spread: float = 0.0,
    **_: Any,
) -> PendulumVectorEnv:  # fmt: skip
    """Return the same, many at once, for `gymnasium.make_vec` with its vectorization mode "vector_entry_point"."""
    return PendulumVectorEnv(
        Fleet([load_learnable_twin(twin)], num_envs, Task(step_s=step_s), encoders, spread)
    )
