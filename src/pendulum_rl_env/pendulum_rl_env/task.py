"""The task of the thesis (sections 5.3-5.4, appendix B): swing up and stand in the middle.

State: measured x (m, 0 in the middle), th (rad, 0 upright, pi hanging, counterclockwise positive,
not wrapped), v (m/s), w (rad/s). Observation: x, v, sin th, cos th, w. Action: PWM fraction, or a
command in the rig's own unit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from pendulum_rl_env.arithmetic import compiled
from pendulum_twin.arrays import Floats
from pendulum_twin.errors import BadInputError
from pendulum_twin.rig import LARGEST_PWM, Rig, check_number

EPISODE_S = 512 * 0.03
HANGING = (0.0, math.pi, 0.0, 0.0)


class End(IntEnum):
    """Say why an episode ended, if it did."""

    NONE = 0
    RAIL = 1
    CART_SPEED = 2
    POLE_SPEED = 3


@dataclass(frozen=True)
class Task:
    """Hold the task's numbers; the defaults are the thesis's.

    step_s: s; from command to command.
    steps: of an episode.
    pwm_limit: PWM fraction, or the unit of the rig's command; the largest command.
    x_limit_m, v_limit_m_s, w_limit_rad_s: an episode ends beyond them.
    rail_penalty: given in place of the reward beyond x_limit_m.
    speed_penalty: given in place of the reward beyond either speed limit.

    Raises BadInputError, naming the key, for a value out of its range.
    """

    step_s: float = 0.03
    steps: int = 512
    pwm_limit: float = 0.5
    x_limit_m: float = 0.7
    v_limit_m_s: float = 3.0
    w_limit_rad_s: float = 15.0
    rail_penalty: float = -50.0
    speed_penalty: float = -30.0

    def __post_init__(self) -> None:
        check_number("step_s", self.step_s, 0.001, 1.0)
        check_number("steps", self.steps, 1, 1e6)
        check_number("pwm_limit", self.pwm_limit, 1e-6, 1e6)
        for name in ("x_limit_m", "v_limit_m_s", "w_limit_rad_s"):
            check_number(name, getattr(self, name), 1e-3, 1e3)

    @classmethod
    def make_for_step(cls, step_s: float) -> Task:
        """Return the task with another sample time and an episode of as many seconds."""
        check_number("step_s", step_s, 0.001, 1.0)
        return cls(step_s=step_s, steps=round(EPISODE_S / step_s))

    def allow_commands(self, rig: Rig) -> Task:
        """Return the task for a rig: up to its largest command.

        Of a PWM fraction no more is used than the task's own limit.
        """
        if rig.pwm_limit is None:
            return self
        is_fraction = rig.pwm_limit <= LARGEST_PWM
        limit = min(self.pwm_limit, rig.pwm_limit) if is_fraction else rig.pwm_limit
        return replace(self, pwm_limit=limit)

    def take_limit(self, pwm_limit: float | None) -> Task:
        """Return the task with another largest command; None leaves it as it is."""
        return self if pwm_limit is None else replace(self, pwm_limit=pwm_limit)

    @property
    def limits(self) -> tuple[float, float, float]:
        """Return the limits of x (m), v (m/s) and w (rad/s)."""
        return self.x_limit_m, self.v_limit_m_s, self.w_limit_rad_s

    @property
    def penalties(self) -> tuple[float, float]:
        """Return the penalties: at the rail, by speed."""
        return self.rail_penalty, self.speed_penalty

    @property
    def bounds(self) -> NDArray[np.float32]:
        """Return the largest size of each observation, (5,), with room beyond the limits.

        One step can carry a state past its limit.
        """
        x, v, w = self.limits
        return np.array([4 * x, 4 * v, 1.0, 1.0, 4 * w], dtype=np.float32)


def choose_step_s(asked_s: float | None, trained: Task | None) -> float:
    """Return the sample time (s) that is asked for, else that of a training, else the thesis's."""
    if asked_s is not None:
        return asked_s
    return (trained or Task()).step_s


@compiled
def find_end_number(x, v, w, limits):
    """Return the number of the `End` of a state; a number that is not finite ends it, too."""
    if not abs(x) <= limits[0]:
        return 1
    if not abs(v) <= limits[1]:
        return 2
    if not abs(w) <= limits[2]:
        return 3
    return 0


def check_commands(commands: Floats) -> None:
    """Raise BadInputError for a command of a policy that is no finite number."""
    broken = commands[~np.isfinite(commands)]
    if len(broken):
        raise BadInputError(
            f"expected a finite PWM fraction, found {broken[0]}: the policy is broken"
        )


def find_end(state: Floats, task: Task) -> End:
    """Return why a measured state (4,) ends the episode; a number that is not finite does, too."""
    x, _, v, w = (float(value) for value in state)
    return End(find_end_number(x, v, w, task.limits))


def make_observation(state: Floats, task: Task) -> NDArray[np.float32]:
    """Return the observations (..., 5) of measured states (..., 4), within `Task.bounds`."""
    x, th, v, w = (state[..., k] for k in range(4))
    observation = np.stack([x, v, np.sin(th), np.cos(th), w], axis=-1)
    return np.clip(observation, -task.bounds, task.bounds).astype(np.float32)
