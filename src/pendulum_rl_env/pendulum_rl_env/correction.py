"""Residual learning: a policy corrects the command of a designed controller.

The command is the controller's own plus a correction within a bound. The policy sees what the
controller knows: the state that its observer predicts for the command, in the twin's true units,
so that delays, filters and scales are undone. Sources: Johannink et al., Residual reinforcement
learning for robot control, ICRA 2019; Silver et al., Residual policy learning, 2018.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from pendulum_rl_env.control.base import Base
from pendulum_rl_env.task import HANGING
from pendulum_twin.arrays import Floats
from pendulum_twin.errors import BadInputError

FEATURES = 8
LARGEST_FEATURE = 10.0
USUAL_SHARE = 0.5  # of the task's limits, that counts as 1

Observations = NDArray[np.float32]


@dataclass(frozen=True)
class Correction:
    """Hold what a policy corrects, and by how much.

    base: the controller.
    bound: share of the PWM limit; the largest correction.
    """

    base: Base
    bound: float


def make_feature_space() -> gym.spaces.Box:
    """Return the space of what a correcting policy sees."""
    return gym.spaces.Box(-LARGEST_FEATURE, LARGEST_FEATURE, (FEATURES,), np.float32)


class Corrector:
    """Correct the commands of controllers side by side, one a pendulum.

    correction: what is corrected, and by how much.
    count: of pendulums.
    """

    def __init__(self, correction: Correction, count: int) -> None:
        task = correction.base.task
        self._controllers = correction.base.make_controllers(count)
        self._bound, self._limit = correction.bound * task.pwm_limit, task.pwm_limit
        self._largest = self._limit
        self._scale = USUAL_SHARE * np.array(task.limits)
        self._commands = np.zeros(count)
        self._features = np.zeros((count, FEATURES), dtype=np.float32)
        self.begin(range(count), np.tile(HANGING, (count, 1)))  # compiles, before any episode

    def heed_limit(self, rig_limit: float) -> None:
        """Clip commands from now on as the rig does, whose observers then know what is applied.

        rig_limit: largest command that the rig takes; infinite where that is not known.
        """
        self._largest = min(self._limit, rig_limit)

    def begin(self, rows: Iterable[int], measured: Floats) -> None:
        """Begin episodes of some pendulums at measured states (pendulums, 4)."""
        rows = list(rows)
        for i in rows:
            self._controllers[i].reset()
        self.follow(rows, measured)

    def follow(self, rows: Iterable[int], measured: Floats) -> None:
        """Let the controllers of some pendulums answer measured states (pendulums, 4)."""
        for i in rows:
            controller = self._controllers[i]
            command = controller(np.array(measured[i], dtype=np.float64))
            x, th, v, w = controller.later
            place, speed, rate = (x, v, w) / self._scale
            swing = controller.is_balancing, controller.progress
            turn = np.sin(th), np.cos(th)
            row = place, speed, *turn, rate, command / self._limit, *swing
            self._features[i] = np.clip(row, -LARGEST_FEATURE, LARGEST_FEATURE)
            self._commands[i] = command

    def show(self) -> Observations:
        """Return what the policy sees, (pendulums, 8).

        Of the state that the command meets: x, v, sin and cos of the angle, and w, in halves of
        the task's limits; the controller's command in units of the limit; whether it balances; the
        share of the planned swing-up that is done.
        """
        return self._features.copy()

    def choose_commands(self, actions: Any) -> Floats:
        """Return the corrected commands, PWM fractions (pendulums,); actions from -1 to 1.

        The controllers are told what they are.
        """
        wanted = np.clip(np.asarray(actions, dtype=np.float64).reshape(-1), -1.0, 1.0)
        chosen = np.clip(self._commands + self._bound * wanted, -self._largest, self._largest)
        for controller, command in zip(self._controllers, chosen.tolist(), strict=True):
            controller.note_command(command)
        return chosen


class CorrectedEnv(gym.Wrapper[Any, Any, Any, Any]):
    """Show an environment's observations, and take its actions, as a correcting policy's.

    env: of a `PendulumEnv`, actions from -1 to 1.

    Raises BadInputError when its commands are not as far apart as the controller's.
    """

    def __init__(self, env: gym.Env[Any, Any], correction: Correction) -> None:
        super().__init__(env)
        step_s = env.unwrapped.task.step_s  # type: ignore[attr-defined]
        if not np.isclose(step_s, correction.base.step_s):
            raise BadInputError(
                f"expected commands {correction.base.step_s} s apart, for which the policy's "
                f"controller was designed, found {step_s}: give --step-s"
            )
        self.observation_space = make_feature_space()
        self._corrector = Corrector(correction, 1)
        self._limit = correction.base.task.pwm_limit

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observations, dict[str, Any]]:
        """Begin an episode."""
        _, info = self.env.reset(seed=seed, options=options)
        self._corrector.heed_limit(info.get("pwm_limit", math.inf))
        self._corrector.begin([0], info["state"][None])
        return self._corrector.show()[0], info

    def step(self, action: Any) -> tuple[Observations, Any, bool, bool, dict[str, Any]]:
        """Hold a corrected command for a period."""
        command = self._corrector.choose_commands(action)
        scaled = (command / self._limit).astype(np.float32)
        _, reward, terminated, truncated, info = self.env.step(scaled)
        self._corrector.follow([0], info["state"][None])
        return self._corrector.show()[0], reward, terminated, truncated, info
