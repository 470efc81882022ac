"""Swing up along the twin's best plan, with feedback, then balance as the classical controller.

The plan is the optimum of the episode's first seconds (`optimum.py`). A time-varying
linear-quadratic regulator keeps the rig near it: the Riccati recursion runs back along the plan,
on the kernel's own derivatives, and knows no limit of the command. Where the pole has arrived, and
whenever the plan has failed, the classical controller has its way.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pendulum_rl_env.control.classical import Classical, Plant, Tuning, make_plant
from pendulum_rl_env.control.design import (
    PERTURBATIONS,
    design_controller,
    make_perturbed_rig,
    rate_controller,
)
from pendulum_rl_env.control.optimum import UPRIGHT_RAD, count_remembered, find_optimum
from pendulum_rl_env.control.rollouts import Run, Slopes, TwinRunner
from pendulum_rl_env.task import Task
from pendulum_twin.arrays import Floats
from pendulum_twin.model import Twin

PLANNED_S = 3.6  # of the episode, that is planned; it is followed only until the pole is up
STARTS = 2  # swing-ups that are improved
DRIVE_SHARES = (1.0, 0.92, 0.84)  # of the PWM limit that plans use; the rest is for feedback
STATE_WEIGHTS = (30.0, 10.0, 2.0, 0.1)  # of the squares of the distances in x, th, v, w
COMMAND_WEIGHTS = (0.3, 0.05)  # of the square of a change of command


@dataclass(frozen=True)
class Plan:
    """Hold a swing-up of n commands.

    commands: (n,) PWM fractions.
    states: (n, 4) true states before each command.
    gains: (n, 4 + m) changes of the command by the distances in state and last m commands.
    """

    commands: Floats
    states: Floats
    gains: Floats

    def measure_turns_rad(self, state: Floats) -> float:
        """Return the whole turns, rad, by which a true state hangs beside the plan's first."""
        return 2 * math.pi * round((float(state[1]) - float(self.states[0, 1])) / (2 * math.pi))

    def correct_command(self, k: int, state: Floats, past: Sequence[float]) -> float:
        """Return command k for a true state and the past commands, the newest first."""
        m = self.gains.shape[1] - 4
        planned = [*self.commands[:k][::-1], *[0.0] * m][:m]
        away = np.subtract([*past, *[0.0] * m][:m], planned)
        distances = np.concatenate([state - self.states[k], away])
        return float(self.commands[k] + self.gains[k] @ distances)


class Planned:
    """Give a PWM fraction for a measured state, once a period; `reset` before each episode.

    plant: the twin, its task and its linear map.
    tuning: of the classical controller.
    plan: of the swing-up; None leaves the swing-up to the classical controller.
    """

    def __init__(self, plant: Plant, tuning: Tuning, plan: Plan | None) -> None:
        self.tuning, self.plan = tuning, plan
        self._classical, self._limit = Classical(plant, tuning), plant.task.pwm_limit
        self.reset()

    def reset(self) -> None:
        """Begin an episode."""
        self._classical.reset()
        self._past: list[float] = []
        self._turns = np.zeros(4)  # a rig's reset ends where its pole hangs, in any turn

    def __call__(self, measured: Floats) -> float:
        """Return the PWM fraction to hold until the next sample; measured: (4,) x, th, v, w."""
        command, k = self._classical(measured), len(self._past)
        if self.plan is not None and k < len(self.plan.commands):
            state = self._classical.state
            if k == 0:
                self._turns[1] = self.plan.measure_turns_rad(state)
            wanted = self.plan.correct_command(k, state - self._turns, self._past[::-1])
            command = min(max(wanted, -self._limit), self._limit)
            self._classical.take_over(command)
            if k + 1 == len(self.plan.commands):
                self._classical.give_back()
        self._past.append(command)
        return command

    def note_command(self, applied: float) -> None:
        """Take note that another command was applied in place of the last."""
        self._past[-1] = applied
        self._classical.note_command(applied)

    @property
    def later(self) -> Floats:
        """Return the true state (4,) that the last command will meet."""
        return self._classical.later

    @property
    def is_balancing(self) -> bool:
        """Tell whether the regulator gave the last command."""
        return self._classical.is_balancing

    @property
    def progress(self) -> float:
        """Return the share of the plan that is done."""
        planned = 0 if self.plan is None else len(self.plan.commands)
        return min(len(self._past) / planned, 1.0) if planned else 1.0


def design_planned(twin: Twin, task: Task) -> Planned:
    """Return the best of the classical controller alone and with plans of the swing-up.

    Each runs on the twins that are not quite this twin (`design.PERTURBATIONS`). Raises
    BadInputError when the twin cannot be balanced.
    """
    plant = make_plant(twin, task)
    tuning = design_controller(twin, task).tuning
    plans = [plan for share in DRIVE_SHARES for plan in make_plans(plant, share)]
    controllers = [Planned(plant, tuning, plan) for plan in [None, *plans]]
    rigs = [make_perturbed_rig(plant.twin, task, *changes) for changes in PERTURBATIONS]
    return max(controllers, key=lambda controller: rate_controller(controller, rigs, task))


def make_plans(plant: Plant, drive_share: float = 1.0) -> list[Plan]:
    """Return the best swing-up found, with feedback of each weight; none when the pole falls.

    drive_share: of the PWM limit, that the plan uses.
    """
    task, remembered = plant.task, count_remembered(plant)
    steps = min(round(PLANNED_S / task.step_s), task.steps)
    frugal = replace(task, steps=steps, pwm_limit=drive_share * task.pwm_limit)
    run = find_optimum(replace(plant, task=frugal), STARTS).run
    arrival = _find_arrival(run)
    if not 0 < arrival < steps:
        return []
    runner = TwinRunner(plant.twin, task.step_s, task.pwm_limit)
    slopes = runner.differentiate(run, remembered)
    gains = [compute_gains(slopes, weight) for weight in COMMAND_WEIGHTS]
    return [Plan(run.commands[:arrival], run.true[:arrival], rows[:arrival]) for rows in gains]


def compute_gains(slopes: Slopes, command_weight: float) -> Floats:
    """Return the gains (n, 4 + m) of a change of command by state and last m commands.

    command_weight: of the square of a change of command.
    """
    n, m = len(slopes.command), slopes.command.shape[1] - 1
    weights = np.diag([*STATE_WEIGHTS, *[0.0] * m])
    a, b = np.zeros((4 + m, 4 + m)), np.zeros(4 + m)
    if m:
        a[5:, 4:-1], b[4] = np.eye(m - 1), 1.0
    gains, ahead = np.zeros((n, 4 + m)), weights
    for k in reversed(range(n)):
        a[:4, :4], a[:4, 4:] = slopes.state[k], slopes.command[k, 1:].T
        b[:4] = slopes.command[k, 0]
        gains[k] = -(b @ ahead @ a) / (command_weight + b @ ahead @ b)
        ahead = weights + a.T @ ahead @ (a + np.outer(b, gains[k]))
    return gains


def _find_arrival(run: Run) -> int:
    """Return the number of commands after which the pole stays within 0.3 rad of upright."""
    lean = np.abs(np.remainder(run.shown[:, 1] + np.pi, 2 * np.pi) - np.pi)
    return int(np.max(np.flatnonzero(lean > UPRIGHT_RAD), initial=-1)) + 1
