"""The thesis's second task (section 4.2): a pendulum that a torque of -2, 0 or 2 N m swings up and keeps up."""

from __future__ import annotations

import math
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

TORQUES_N_M = (-2.0, 0.0, 2.0)
GRAVITY_M_S2, MASS_KG, LENGTH_M = 10.0, 1.0, 1.0
STEP_S = 0.05
FASTEST_RAD_S = 8.0
STEPS = 500

Observation = NDArray[np.float32]


class SamplePendulum(gym.Env[Observation, int]):
    """Swing up a rod about its end; too weak to lift it at once, the torque has to pump.

    Observation, float32 (3,): cos and sin of the angle from upright, rate (rad/s, within +-8).
    Action: which of TORQUES_N_M. Reward of a step: -(th^2 + 0.1 w^2 + 0.001 u^2) of the state it
    begins in, th within +-pi. Starts anywhere, at up to 1 rad/s. Dynamics, step and reward are
    those of Gymnasium's Pendulum-v1, which the thesis's section 4.2 builds on (its equation 17 is
    quoted nowhere that we have); three torques instead of any are the thesis's.
    """

    metadata: dict[str, Any] = {"render_modes": [], "render_fps": round(1 / STEP_S)}  # noqa: RUF012

    def __init__(self, render_mode: str | None = None) -> None:
        self.render_mode = render_mode
        high = np.array([1.0, 1.0, FASTEST_RAD_S], dtype=np.float32)
        self.observation_space = gym.spaces.Box(-high, high, dtype=np.float32)
        self.action_space: gym.spaces.Discrete = gym.spaces.Discrete(len(TORQUES_N_M))  # type: ignore[assignment]
        self._th, self._w = math.pi, 0.0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start anywhere, at up to 1 rad/s."""
        super().reset(seed=seed)
        self._th = float(self.np_random.uniform(-math.pi, math.pi))
        self._w = float(self.np_random.uniform(-1.0, 1.0))
        return self._seen(), {}

    def step(self, action: int) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Apply one of the torques for a step."""
        torque = TORQUES_N_M[int(action)]
        th = math.remainder(self._th, math.tau)
        cost = th**2 + 0.1 * self._w**2 + 0.001 * torque**2
        turn = (
            1.5 * GRAVITY_M_S2 / LENGTH_M * math.sin(self._th)
            + 3.0 / (MASS_KG * LENGTH_M**2) * torque
        )
        self._w = min(max(self._w + turn * STEP_S, -FASTEST_RAD_S), FASTEST_RAD_S)
        self._th += self._w * STEP_S
        return self._seen(), -cost, False, False, {}

    def _seen(self) -> Observation:
        return np.array([math.cos(self._th), math.sin(self._th), self._w], dtype=np.float32)
