"""The thesis's torque pendulum (section 4.2): a torque of -2, 0 or 2 N m swings a rod up."""

from __future__ import annotations

import math
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from pendulum_rl_env.rendering import RENDER_MODES, Renderer
from pendulum_twin.arrays import Floats

TORQUES_N_M = (-2.0, 0.0, 2.0)
GRAVITY_M_S2, MASS_KG, LENGTH_M = 10.0, 1.0, 1.0
STEP_S = 0.05
RATE_LIMIT_RAD_S = 8.0
STEPS = 500
SHOWN_HALF_RAIL_M = 0.7  # in pictures

Observation = NDArray[np.float32]


class SamplePendulum(gym.Env[Observation, int]):
    """Swing up a rod about its end; the torque is too weak to lift the rod at once.

    Observation: float32 (3,): cos and sin of the angle from upright; rate, rad/s, within +-8.
    Action: index into `TORQUES_N_M`.
    Reward: 1 - |angle / pi| of the state that a step leads to, angle from upright within +-pi
        (thesis, equation 17): 1 upright, 0 hanging.
    Start: any angle, a rate within +-1 rad/s.
    Episode: 500 steps, 25 s; a mean reward of an episode above 390 counts as solved.

    Rod, step and integration are those of Gymnasium's Pendulum-v1, which section 4.2 starts from.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012
        "render_modes": list(RENDER_MODES),
        "render_fps": round(1 / STEP_S),
    }

    def __init__(self, render_mode: str | None = None) -> None:
        self.render_mode = render_mode
        high = np.array([1.0, 1.0, RATE_LIMIT_RAD_S], dtype=np.float32)
        self.observation_space = gym.spaces.Box(-high, high, dtype=np.float32)
        torques = gym.spaces.Discrete(len(TORQUES_N_M))
        self.action_space: gym.spaces.Discrete = torques  # type: ignore[assignment]
        self._th, self._w, self._steps = math.pi, 0.0, 0
        self._renderer = Renderer(render_mode, SHOWN_HALF_RAIL_M, STEP_S)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start at any angle, with a rate within +-1 rad/s."""
        super().reset(seed=seed)
        self._th = float(self.np_random.uniform(-math.pi, math.pi))
        self._w = float(self.np_random.uniform(-1.0, 1.0))
        self._steps = 0
        self._renderer.follow(self._state, 0.0)
        return self._make_observation(), {}

    def step(self, action: int) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Apply one of the torques for a step."""
        gravity = 1.5 * GRAVITY_M_S2 / LENGTH_M * math.sin(self._th)
        drive = 3.0 / (MASS_KG * LENGTH_M**2) * TORQUES_N_M[int(action)]
        rate = self._w + (gravity + drive) * STEP_S
        self._w = min(max(rate, -RATE_LIMIT_RAD_S), RATE_LIMIT_RAD_S)
        self._th += self._w * STEP_S
        self._steps += 1
        self._renderer.follow(self._state, self._steps * STEP_S)
        reward = 1.0 - abs(math.remainder(self._th, math.tau) / math.pi)
        return self._make_observation(), reward, False, False, {}

    def render(self) -> NDArray[np.uint8] | None:  # type: ignore[override]
        """Return a picture of the rod, (height, width, 3), or show it in the window."""
        return self._renderer.render(self._state, self._steps * STEP_S)

    def close(self) -> None:
        """Close the window, if there is a window."""
        self._renderer.close()

    @property
    def _state(self) -> Floats:
        """Return the rod as a pendulum whose cart stays in the middle: x, th, v, w."""
        return np.array([0.0, self._th, 0.0, self._w])

    def _make_observation(self) -> Observation:
        return np.array([math.cos(self._th), math.sin(self._th), self._w], dtype=np.float32)
