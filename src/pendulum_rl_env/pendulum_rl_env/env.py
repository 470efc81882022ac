"""The pendulum as a Gymnasium environment, independent of what carries commands and samples."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from pendulum_rl_env.noise import NoiseFilter
from pendulum_rl_env.rendering import RENDER_MODES, Renderer
from pendulum_rl_env.reward import compute_reward
from pendulum_rl_env.task import End, Task, check_commands, find_end, make_observation
from pendulum_rl_env.transport import Transport

Observation = NDArray[np.float32]


class PendulumEnv(gym.Env[Observation, Observation]):
    """Swing the pole up and keep it up.

    Observation: float32 (5,): x, m; v, m/s; sin and cos of the angle from upright; w, rad/s.
    Action: float32 (1,): PWM fraction within +-0.5; see `Task.allow_commands` for other limits
        and units.
    Reward: `reward.compute_reward` of the state that the action led to.
    Start: hanging at rest in the middle.
    End: terminated beyond the task's limits, with a penalty in place of the reward; a wrapper
        limits the length.

    `info` holds all that the transport reports of the exchange, and:

    state: (4,) measured x, th, v, w.
    end: "none", "rail", "cart_speed" or "pole_speed".
    noise_dropped: samples rejected as noise so far.
    applied_pwm: command after the limits of task and rig. What a driver does beyond its limit
        (slew, rail guard) does not count; it is on the topic `applied_pwm`.

    render_mode: "rgb_array" for pictures of cart and pole, "human" for a window.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012
        "render_modes": list(RENDER_MODES),
        "render_fps": round(1 / Task.step_s),  # of an instance by its own step
    }

    def __init__(
        self, transport: Transport, task: Task | None = None, render_mode: str | None = None
    ) -> None:
        self.task = task or Task(step_s=transport.step_s)
        self.render_mode = render_mode
        self.metadata = {**self.metadata, "render_fps": round(1 / self.task.step_s)}
        self.transport = transport
        self.observation_space = gym.spaces.Box(
            -self.task.bounds, self.task.bounds, dtype=np.float32
        )
        self.action_space = gym.spaces.Box(
            -self.task.pwm_limit, self.task.pwm_limit, (1,), np.float32
        )
        self._noise = NoiseFilter(self.task)
        self._limit = self.task.pwm_limit
        self._state = np.array([0.0, np.pi, 0.0, 0.0])
        self._steps = 0
        self._renderer = Renderer(render_mode, self.task.x_limit_m, self.task.step_s)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Bring the pendulum to hang at rest in the middle; raise NoAnswerError on a failure."""
        super().reset(seed=seed)
        sample = self._noise.start(self.transport.reset())
        self._state, self._steps = sample.state, 0
        self._limit = min(self.task.pwm_limit, sample.info.get("pwm_limit", math.inf))
        self._renderer.follow(self._state, 0.0)
        info = self._make_info(sample.info, End.NONE, 0.0)
        return make_observation(self._state, self.task), info

    def step(self, action: Observation) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Hold a PWM fraction for a period.

        Raises BadInputError for a command that is no number, NoAnswerError when no sample comes.
        """
        wanted = np.asarray(action, dtype=np.float64).reshape(-1)[:1]
        check_commands(wanted)
        command = float(np.clip(wanted[0], -self._limit, self._limit))
        sample = self.transport.exchange(command)
        self._state = self._noise.select(sample).state
        self._steps += 1
        self._renderer.follow(self._state, self._steps * self.task.step_s)
        end = find_end(self._state, self.task)
        return (
            make_observation(self._state, self.task),
            compute_reward(self._state, self.task),
            end != End.NONE,
            False,
            self._make_info(sample.info, end, command),
        )

    def render(self) -> NDArray[np.uint8] | None:  # type: ignore[override]
        """Return a picture of cart and pole, (height, width, 3), or show it in the window."""
        return self._renderer.render(self._state, self._steps * self.task.step_s)

    def close(self) -> None:
        """Close the transport, and the window if there is a window."""
        self._renderer.close()
        self.transport.close()

    def _make_info(self, exchange: Mapping[str, float], end: End, command: float) -> dict:
        return {
            **exchange,
            "state": self._state.copy(),
            "end": end.name.lower(),
            "noise_dropped": self._noise.dropped,
            "applied_pwm": command,
        }
