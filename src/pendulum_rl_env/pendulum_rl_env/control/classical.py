"""The classical controller: energy swing-up, then a linear-quadratic regulator, both on what a twin knows of the rig.

It is given what the rig measures and gives what the rig takes. Between them it thinks in the
twin's true states and in
drives: signs, zeros and scales are undone on the way in, dead zone, asymmetry and saturation on
the way out, delays and lag by predicting, forces that the twin knows (dry friction among them, by
the way the cart is to move) by adding them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pendulum_rl_env.control.lqr import (
    LinearMap,
    Upright,
    design_regulator,
    find_upright,
    keep_smooth_effects,
    linearise,
)
from pendulum_rl_env.control.observer import Observer
from pendulum_rl_env.control.rig_forces import compute_drive
from pendulum_rl_env.control.static_drive import make_static_drive
from pendulum_rl_env.control.swing_up import SwingUp, compute_acceleration
from pendulum_rl_env.kernel_transport import lasting
from pendulum_rl_env.task import Task
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import FORCE_PER_PWM, MASS, make_theta

Floats = NDArray[np.float64]

CATCH_ANGLE_RAD = 0.7  # further from upright nothing is caught
RELEASE_ANGLE_RAD = 1.0  # and what is caught is let go of
INTEGRATION_RANGE = 0.15  # m, and m/s: within it the sum of x counts
FULL_FRICTION_SPEED_M_S = (
    0.03  # m/s: below it dry friction is overcome in part, lest it be overcome to and fro
)


@dataclass(frozen=True)
class Tuning:
    """Hold what can be chosen.

    weights: of the squares of x, th, v, w and the sum of x; effort: of that of the drive (see
    `lqr.regulator`). catch: the largest drive, in units of what the rig has, that the regulator
    may ask for when it takes over. dry: share of dry friction that is overcome.
    """

    weights: tuple[float, ...] = (30.0, 10.0, 0.5, 0.1, 0.01)
    effort: float = 3.0
    catch: float = 1.0
    dry: float = 0.9
    swing: SwingUp = field(default_factory=SwingUp)


@dataclass(frozen=True)
class Plant:
    """Hold what a controller takes from a twin, whatever its tuning."""

    twin: Twin
    task: Task
    linear: LinearMap


def make_plant(twin: Twin, task: Task) -> Plant:
    """Return what controllers of this twin share; raise BadInputError for a twin without cart, pole or drive."""
    if not (twin.rig.has_cart and twin.rig.has_pole and twin.rig.force_per_pwm_n):
        raise BadInputError(
            f"{twin.name}: expected a rig with cart, pole and drive to control, found a part missing"
        )
    twin = lasting(twin)
    return Plant(twin, task, linearise(twin, find_upright(twin), task.step_s))


class Classical:
    """Give a PWM fraction for a measured state x, th, v, w, once a period; `reset` before each episode."""

    def __init__(self, plant: Plant, tuning: Tuning) -> None:
        twin, self._task, self._linear = plant.twin, plant.task, plant.linear
        self.tuning = tuning
        self._twin = twin
        self._drive = make_static_drive(twin, plant.task.pwm_limit)
        self._theta, self._smooth = make_theta(twin), make_theta(keep_smooth_effects(twin))
        late_s = sum(
            twin.effects.get(name, {}).get("delay_s", 0.0)
            for name in ("input_delay", "sensor_delay")
        )
        late_s += twin.effects.get("motor_lag", {}).get("time_constant_s", 0.0)
        self._observer = Observer(twin, plant.task.step_s, late_s + 0.5 * plant.task.step_s)
        self._gains = design_regulator(plant.linear, tuning.weights, tuning.effort)
        self._strongest = (
            0.95 * self._drive.reach * float(self._theta[FORCE_PER_PWM] / self._theta[MASS])
        )
        self._upright: dict[int, Upright] = {}
        self.reset()

    def reset(self) -> None:
        """Begin an episode."""
        self._observer.reset()
        self._past = np.zeros(len(self._gains) - 5)
        self._command, self._balancing, self._steps, self._sum = 0.0, False, 0, 0.0

    def __call__(self, measured: Floats) -> float:
        """Return the PWM fraction to hold until the next sample."""
        state = self._observer.seen(measured, self._command)
        later = self._observer.ahead(self._command)
        at = self._nearest(float(state[1]))
        wanted = at.drive - float(
            self._gains @ np.concatenate([state - at.state, [self._sum], self._past])
        )
        self._balancing = self._is_balancing(float(state[1]) - at.angle_rad, wanted)
        if self._balancing:
            self._add_up(state)
            drive, extra = wanted, self._extra(wanted, later)
        else:
            push = compute_acceleration(
                later, self._theta, self._strongest, self.tuning.swing, self._task, at.angle_rad
            )
            drive, extra = compute_drive(push, self._way(push, later), later, self._theta), 0.0
        t_s = self._steps * self._task.step_s
        self._command = self._drive.asked(drive + extra, t_s)
        self._remember(self._drive.given(self._command, t_s) - extra - at.drive)
        self._steps += 1
        return self._command

    def _add_up(self, state: Floats) -> None:
        """Sum up where the cart is when it has come to the end of its way: before, it is on its way."""
        if abs(state[0]) < INTEGRATION_RANGE and abs(state[2]) < INTEGRATION_RANGE:
            self._sum += float(state[0])

    def _is_balancing(self, angle: float, wanted: float) -> bool:
        if self._balancing:
            return abs(angle) < RELEASE_ANGLE_RAD
        return abs(angle) < CATCH_ANGLE_RAD and abs(wanted) < self.tuning.catch * self._drive.reach

    def _extra(self, drive: float, later: Floats) -> float:
        """Return the drive for what the twin has beyond its smooth part, when the smooth part is to get this much."""
        free = compute_drive(0.0, 0.0, later, self._smooth)
        push = (drive - free) * float(self._theta[FORCE_PER_PWM] / self._theta[MASS])
        way = self._way(push, later)
        return compute_drive(push, way, later, self._theta) - compute_drive(
            push, 0.0, later, self._smooth
        )

    def _way(self, push: float, later: Floats) -> float:
        """Return which way the cart is to move and dry friction to be overcome, by which share."""
        speed = float(later[2]) + push * self._task.step_s
        return self.tuning.dry * min(max(speed / FULL_FRICTION_SPEED_M_S, -1.0), 1.0)

    def _nearest(self, angle: float) -> Upright:
        turn = round(angle / (2 * math.pi))
        if turn not in self._upright:
            self._upright[turn] = find_upright(self._twin, turn)
        return self._upright[turn]

    def _remember(self, drive: float) -> None:
        if len(self._past):
            self._past = np.concatenate([[drive], self._past[:-1]])
