"""A fleet whose pendulums have a controller each that the policy corrects; see `correction.py`."""

from __future__ import annotations

from typing import Any

import numpy as np
from stable_baselines3.common.vec_env.base_vec_env import VecEnvStepReturn, VecEnvWrapper

from pendulum_rl_env.correction import Correction, Corrector, make_feature_space
from pendulum_rl_env.learning.fleet_vec_env import FleetVecEnv


class CorrectedVecEnv(VecEnvWrapper):
    """Show a fleet as a correcting policy sees it.

    fleet: the pendulums.
    correction: what is corrected, and by how much.
    deduction: from every reward, so that values begin near what they are: 1 is upright at rest.
    fixed_seed: of the twins and starts at every reset; None goes on drawing.
    """

    def __init__(
        self,
        fleet: FleetVecEnv,
        correction: Correction,
        deduction: float = 0.0,
        fixed_seed: int | None = None,
    ) -> None:
        super().__init__(fleet, make_feature_space())
        self._fleet, self._limit = fleet, fleet.task.pwm_limit
        self._corrector = Corrector(correction, fleet.num_envs)
        self._corrector.heed_limit(fleet.pwm_limit)
        self._deduction, self._fixed_seed = deduction, fixed_seed

    def reset(self) -> Any:
        """Begin every episode anew."""
        if self._fixed_seed is not None:
            self._fleet.seed(self._fixed_seed)
        self._fleet.reset()
        self._corrector.begin(range(self.num_envs), self._fleet.measured)
        return self._corrector.show()

    def step_async(self, actions: Any) -> None:
        """Keep the corrected commands for `step_wait`."""
        self._fleet.step_async(self._corrector.choose_commands(actions) / self._limit)

    def step_wait(self) -> VecEnvStepReturn:
        """Step all pendulums; a terminal observation is the controller's, too."""
        _, rewards, dones, infos = self._fleet.step_wait()
        self._corrector.follow(range(self.num_envs), self._fleet.last_measured)
        over = np.flatnonzero(dones).tolist()
        if over:
            shown = self._corrector.show()
            for i in over:
                infos[i] = {**infos[i], "terminal_observation": shown[i]}
            self._corrector.begin(over, self._fleet.measured)
        return self._corrector.show(), rewards - self._deduction, dones, infos
