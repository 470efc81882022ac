"""Model predictive control: every period the commands of the next second are planned anew.

The plan begins as the nearest part of the twin's best episode (`optimum.py`) with its feedback, or
as the last plan, and ends with the value that the best episode has there. It runs on the kernel,
with all that the twin holds; an observer says where the rig is. The best episode leaves a part of
drive, rail and speeds for what the twin does not know.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from pendulum_rl_env.control.classical import Plant, make_plant
from pendulum_rl_env.control.observer import Observer
from pendulum_rl_env.control.optimum import (
    Optimum,
    compute_feedback,
    count_remembered,
    find_optimum,
)
from pendulum_rl_env.control.rollouts import Run, TwinRunner
from pendulum_rl_env.control.smooth_reward import compute_smooth_reward
from pendulum_rl_env.control.trajectory import Value, compute_policy
from pendulum_rl_env.task import Task
from pendulum_twin.arrays import Floats
from pendulum_twin.model import Twin

HORIZON = 40  # periods that are planned
TAIL = 60  # last periods of the best episode, at which no plan ends: what follows is not known
ROUNDS = 3  # of improvement a period
ROUNDNESS = 0.3  # of the reward's corners
WEIGHT = 1e-2  # of the square of a change of command
NEAR = np.array([0.1, 0.2, 0.5, 2.0])  # m, rad, m/s, rad/s; distances that count alike
DRIVE_SHARE, LIMIT_SHARE = 0.85, 0.85  # of the task's, that the best episode may use
SHARES: Floats = 2.0 ** -np.arange(
    8, dtype=np.float64
)  # of a change of plan that are tried at once
PATIENCE = 1.0  # by which another place of the episode has to be nearer than the next in turn


def leave_margins(task: Task) -> Task:
    """Return the task with less drive, rail and speed, for a best episode that can be followed."""
    return replace(
        task,
        pwm_limit=DRIVE_SHARE * task.pwm_limit,
        x_limit_m=LIMIT_SHARE * task.x_limit_m,
        v_limit_m_s=LIMIT_SHARE * task.v_limit_m_s,
    )


def design_predictive(twin: Twin, task: Task, starts: int = 2) -> Predictive:
    """Return the predictive controller of a twin; see `find_optimum`."""
    return Predictive(
        make_plant(twin, task), find_optimum(make_plant(twin, leave_margins(task)), starts)
    )


class Predictive:
    """Give a PWM fraction for a measured state, once a period; `reset` before each episode.

    plant: the twin, its task and its linear map.
    optimum: the twin's best episode, of the task with margins.
    """

    def __init__(self, plant: Plant, optimum: Optimum) -> None:
        self._task = leave_margins(plant.task)
        self._remembered = count_remembered(plant)
        self._runner = TwinRunner(plant.twin, plant.task.step_s, plant.task.pwm_limit)
        self._observer = Observer(plant.twin, plant.task.step_s)
        self._plan = optimum.run
        self._policy = compute_feedback(
            make_plant(plant.twin, self._task), self._runner, optimum.run, ROUNDNESS
        )
        self._horizon = min(HORIZON, len(optimum.run.commands) // 2)
        self._places = max(len(optimum.run.commands) - self._horizon - TAIL, 1)
        self.reset()

    def reset(self) -> None:
        """Begin an episode."""
        self._observer.reset()
        self._command, self._place = 0.0, -1
        self._last: Run | None = None

    def __call__(self, measured: Floats) -> float:
        """Return the PWM fraction to hold until the next sample; measured: (4,) x, th, v, w."""
        state = self._observer.correct(measured, self._command)
        self._place, turn = self._find_place(state)
        run, planned = self._follow_plan(turn)
        run = self._choose_best([run, *self._go_on()], planned)
        for _ in range(ROUNDS):
            run = self._improve(run, planned)
        self._last, self._command = run, float(run.commands[0])
        return self._command

    def _find_place(self, state: Floats) -> tuple[int, float]:
        """Return the nearest place in the best episode, and its turn's angle from the rig's."""
        planned = self._plan.true[: self._places]
        turns = np.round((state[1] - planned[:, 1]) / (2 * math.pi)) * 2 * math.pi
        away = state - planned
        away[:, 1] -= turns
        distances = np.sum((away / NEAR) ** 2, axis=1)
        following = min(self._place + 1, self._places - 1)
        place = int(np.argmin(distances))
        if distances[following] < distances[place] + PATIENCE:
            place = following
        return place, float(turns[place])

    def _follow_plan(self, turn: float) -> tuple[Run, Floats]:
        """Return the run of the best episode's commands and feedback, and the planned end."""
        first, last = self._place, self._place + self._horizon
        planned = self._plan.true[first : last + 1] + np.array([0.0, turn, 0.0, 0.0])
        gains = self._policy.gains[first:last]
        commands = self._plan.commands[first:last]
        start, nothing = self._observer.make_snapshot(), np.zeros(self._horizon)
        run = self._runner.follow(commands, planned, nothing, gains, start, np.zeros(1))[0]
        return run, planned[-1]

    def _go_on(self) -> list[Run]:
        """Return the run of the last plan from where the rig is now, if there is a last plan."""
        if self._last is None:
            return []
        commands = np.append(self._last.commands[1:], self._last.commands[-1])
        return [self._runner.run(commands, self._observer.make_snapshot())]

    def _improve(self, run: Run, planned: Floats) -> Run:
        """Return a run with more smooth reward and value, or the same run."""
        value = self._value_at(run, planned)
        policy = compute_policy(
            self._runner, run, self._task, self._remembered, ROUNDNESS, WEIGHT, value
        )
        start = run.make_snapshot(0)
        tried = self._runner.follow(
            run.commands, run.true, policy.way, policy.gains, start, SHARES
        )
        return self._choose_best([run, *tried], planned)

    def _value_at(self, run: Run, planned: Floats) -> Value:
        """Return the cost ahead, as a quadratic about the end of a run."""
        value = self._policy.get_value(self._place + self._horizon)
        away = self._measure_distance(run, planned)
        return Value(value.gradient + value.hessian @ away, value.hessian)

    def _choose_best(self, runs: list[Run], planned: Floats) -> Run:
        """Return the run with the most smooth reward and promise of the plan after it."""
        shown = np.concatenate([run.shown[1:] for run in runs])
        smooth = compute_smooth_reward(shown, self._task, ROUNDNESS)[0]
        value = self._policy.get_value(self._place + self._horizon)
        away = np.array([self._measure_distance(run, planned) for run in runs])
        ahead = away @ value.gradient + 0.5 * np.einsum("ri,ij,rj->r", away, value.hessian, away)
        rating = smooth.reshape(len(runs), -1).sum(axis=1) - ahead
        return runs[int(np.argmax(np.where(np.isfinite(rating), rating, -np.inf)))]

    def _measure_distance(self, run: Run, planned: Floats) -> Floats:
        """Return the distance of a run's end from the plan, past commands included."""
        end = self._place + self._horizon
        now, then = run.commands, self._plan.commands[:end]
        past = [now[-1 - j] - then[-1 - j] for j in range(self._remembered)]
        return np.concatenate([run.true[-1] - planned, past])
