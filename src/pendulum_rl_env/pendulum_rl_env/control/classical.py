"""The classical controller: energy swing-up, then a linear-quadratic regulator, both on a twin.

It takes what the rig measures and gives the command that the rig takes. In between it works in the
twin's true states and in drives:

- on the way in, the observer undoes signs, zeros and scales;
- on the way out, dead zone, asymmetry and saturation are undone;
- a prediction makes up for delays and lag;
- forces that the twin knows are added; dry friction acts by the direction in which the cart is to
  move.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

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
from pendulum_rl_env.task import Task
from pendulum_twin.arrays import Floats
from pendulum_twin.effects import BY_NAME
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import FORCE_PER_PWM, MASS, make_theta

CATCH_ANGLE_RAD = 0.7  # from upright: further away the regulator does not take over
RELEASE_ANGLE_RAD = 1.0  # from upright: further away the regulator gives up
INTEGRATION_RANGE = 0.15  # m, and m/s: within it the sum of x grows
FULL_FRICTION_SPEED_M_S = 0.03  # below it friction is overcome in part, so that nothing chatters
REACH_SHARE = 0.95  # of the drive's reach, that the swing-up uses


@dataclass(frozen=True)
class Tuning:
    """Hold what a design may choose.

    weights: (5,) of the squares of x, th, v, w and the sum of x; see `lqr.design_regulator`.
    effort: weight of the square of the drive.
    catch: in units of the rig's reach; the largest drive at which the regulator takes over.
    dry: share of dry friction that is overcome.
    swing: numbers of the swing-up.
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
    """Return what controllers of this twin share.

    Raises BadInputError for a twin without cart, pole or drive.
    """
    if not (twin.rig.has_cart and twin.rig.has_pole and twin.rig.force_per_pwm_n):
        raise BadInputError(
            f"{twin.name}: expected a rig with cart, pole and drive to control, found a part "
            "missing"
        )
    twin = twin.drop_recording_effects()
    return Plant(twin, task, linearise(twin, find_upright(twin), task.step_s))


def sum_delays(twin: Twin) -> float:
    """Return by how many seconds the measured motion follows the command."""
    return sum(
        values[parameter.name]
        for name, values in twin.effects.items()
        for parameter in BY_NAME[name].parameters
        if parameter.delays
    )


class Classical:
    """Give a PWM fraction for a measured state, once a period; `reset` before each episode.

    plant: the twin, its task and its linear map.
    tuning: what the design has chosen.
    state, later: (4,) true x, th, v, w at the last measurement, and where the command meets it.
    is_balancing: whether the regulator gave the last command.
    """

    def __init__(self, plant: Plant, tuning: Tuning) -> None:
        twin, step_s = plant.twin, plant.task.step_s
        self.tuning = tuning
        self._twin, self._task = twin, plant.task
        self._drive = make_static_drive(twin, plant.task.pwm_limit)
        self._theta = make_theta(twin.drop_timed_effects())
        self._smooth_theta = make_theta(keep_smooth_effects(twin))
        self._push_per_drive = float(self._theta[FORCE_PER_PWM] / self._theta[MASS])  # m/s^2
        self._strongest = REACH_SHARE * self._drive.reach * self._push_per_drive
        self._observer = Observer(twin, step_s, sum_delays(twin) + 0.5 * step_s)
        self._gains = design_regulator(plant.linear, tuning.weights, tuning.effort)
        self._uprights: dict[int, Upright] = {}
        self.reset()

    def reset(self) -> None:
        """Begin an episode."""
        self._observer.reset()
        self._past = np.zeros(len(self._gains) - 5)
        self._command, self.is_balancing, self._steps, self._sum_of_x = 0.0, False, 0, 0.0
        self.state = self.later = np.zeros(4)

    def __call__(self, measured: Floats) -> float:
        """Return the PWM fraction to hold until the next sample; measured: (4,) x, th, v, w."""
        self.state = state = self._observer.correct(measured, self._command)
        self.later = later = self._observer.predict(self._command)
        at = self._find_nearest_upright(float(state[1]))
        distances = np.concatenate([state - at.state, [self._sum_of_x], self._past])
        wanted = at.drive - float(self._gains @ distances)
        self.is_balancing = self._may_balance(float(state[1]) - at.angle_rad, wanted)
        if self.is_balancing:
            self._add_up(state)
            drive, extra = wanted, self._compute_extra(wanted, later)
        else:
            drive, extra = self._swing_up(later, at), 0.0
        t_s = self._steps * self._task.step_s
        self._command = self._drive.compute_pwm(drive + extra, t_s)
        self._remember(self._drive.compute_drive(self._command, t_s) - extra - at.drive)
        self._steps += 1
        return self._command

    def note_command(self, applied: float) -> None:
        """Take note that another command was applied in place of the last."""
        if applied == self._command:
            return
        t_s = (self._steps - 1) * self._task.step_s
        if len(self._past):
            change = self._drive.compute_drive(applied, t_s)
            self._past[0] += change - self._drive.compute_drive(self._command, t_s)
        self._command = applied

    def take_over(self, applied: float) -> None:
        """Take note that another controller gave the last command; the regulator lets go."""
        self.note_command(applied)
        self.is_balancing, self._sum_of_x = False, 0.0

    def give_back(self) -> None:
        """Give the pole to the regulator, however hard it will have to push at first."""
        self.is_balancing = True

    def _swing_up(self, later: Floats, at: Upright) -> float:
        """Return the drive of the swing-up at the predicted state."""
        push = compute_acceleration(
            later, self._theta, self._strongest, self.tuning.swing, self._task, at.angle_rad
        )
        return compute_drive(push, self._choose_way(push, later), later, self._theta)

    def _add_up(self, state: Floats) -> None:
        """Add x to its sum once the cart has arrived: on its way the sum would only overshoot."""
        if abs(state[0]) < INTEGRATION_RANGE and abs(state[2]) < INTEGRATION_RANGE:
            self._sum_of_x += float(state[0])

    def _may_balance(self, angle: float, wanted: float) -> bool:
        """Tell whether the regulator keeps or takes the pole: angle from upright, rad; drive."""
        if self.is_balancing:
            return abs(angle) < RELEASE_ANGLE_RAD
        return abs(angle) < CATCH_ANGLE_RAD and abs(wanted) < self.tuning.catch * self._drive.reach

    def _compute_extra(self, drive: float, later: Floats) -> float:
        """Return the drive for forces beyond the smooth part, which is to get `drive`."""
        free = compute_drive(0.0, 0.0, later, self._smooth_theta)
        push = (drive - free) * self._push_per_drive
        way = self._choose_way(push, later)
        smooth = compute_drive(push, 0.0, later, self._smooth_theta)
        return compute_drive(push, way, later, self._theta) - smooth

    def _choose_way(self, push: float, later: Floats) -> float:
        """Return the direction of the cart times the share of dry friction to overcome."""
        speed = float(later[2]) + push * self._task.step_s
        return self.tuning.dry * min(max(speed / FULL_FRICTION_SPEED_M_S, -1.0), 1.0)

    def _find_nearest_upright(self, angle: float) -> Upright:
        turn = round(angle / (2 * math.pi))
        if turn not in self._uprights:
            self._uprights[turn] = find_upright(self._twin, turn)
        return self._uprights[turn]

    def _remember(self, drive: float) -> None:
        if len(self._past):
            self._past = np.concatenate([[drive], self._past[:-1]])
