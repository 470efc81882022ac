"""The policy of PPO that corrects a designed controller: it begins with no correction at all."""

from __future__ import annotations

from typing import Any

import torch
from stable_baselines3.common.policies import ActorCriticPolicy

from pendulum_rl_env.correction import Correction

LOG_STD = -2.0  # of the corrections that are explored at first, in units of the bound


class CorrectingPolicy(ActorCriticPolicy):
    """Correct a controller.

    correction: the controller, and how large the correction may be.
    Other arguments: see stable-baselines3.
    """

    def __init__(self, *spaces: Any, correction: Correction, **settings: Any) -> None:
        super().__init__(*spaces, **{"log_std_init": LOG_STD, **settings})
        self.correction = correction
        with torch.no_grad():
            for parameter in self.action_net.parameters():
                parameter.zero_()
