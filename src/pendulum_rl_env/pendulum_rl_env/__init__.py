"""Gymnasium environments of the pendulum: in process, over topics, and a torque pendulum.

Without an import of this package: Gymnasium 1 takes `gym.make("pendulum_rl_env:<id>")`, and
Gymnasium before 1 finds the ids by the entry point `gymnasium.envs`.
"""

from __future__ import annotations

from pendulum_rl_env.registration import register_environments
from pendulum_rl_env.version import __version__

__all__ = ["__version__", "register_environments"]

register_environments()
