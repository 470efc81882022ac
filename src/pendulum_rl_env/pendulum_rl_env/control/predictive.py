"""Model predictive control: every period a plan of the next second is improved from where the rig is.

The plan begins as the nearest part of the twin's best episode (`optimum.py`) with its feedback, and
ends with the value that the best episode has there. It runs on the kernel, with all that the twin
holds; an observer says where the rig is.
"""

from __future__ import annotations

import math

import numpy as np

from pendulum_rl_env.control.classical import Plant
from pendulum_rl_env.control.observer import Observer
from pendulum_rl_env.control.optimum import Optimum, compute_feedback, count_remembered
from pendulum_rl_env.control.rollouts import Run, TwinRunner
from pendulum_rl_env.control.smooth_reward import compute_smooth_reward
from pendulum_rl_env.control.trajectory import Value, compute_policy
from pendulum_twin.arrays import Floats

HORIZON = 40  # periods that are planned
TAIL = 60  # last periods of the best episode, at which no plan ends: what follows is not known
ROUNDS = 2  # of improvement a period
ROUNDNESS = 0.3  # of the reward's corners
WEIGHT = 1e-2  # of the square of a change of command
NEAR = np.array([0.1, 0.2, 0.5, 2.0])  # m, rad, m/s, rad/s; distances that count alike
PATIENCE = 1.0  # by which another place of the episode has to be nearer than the next in turn


class Predictive:
    """Give a PWM fraction for a measured state, once a period; `reset` before each episode.

    plant: the twin, its task and its linear map.
    optimum: the twin's best episode.
    """

    def __init__(self, plant: Plant, optimum: Optimum) -> None:
        self._task = plant.task
        self._remembered = count_remembered(plant)
        self._runner = TwinRunner(plant.twin, plant.task.step_s, plant.task.pwm_limit)
        self._observer = Observer(plant.twin, plant.task.step_s)
        self._plan = optimum.run
        self._policy = compute_feedback(plant, self._runner, optimum.run, ROUNDNESS)
        self._horizon = min(HORIZON, len(optimum.run.commands) // 2)
        self._places = max(len(optimum.run.commands) - self._horizon - TAIL, 1)
        self.reset()

    def reset(self) -> None:
        """Begin an episode."""
        self._observer.reset()
        self._command, self._place = 0.0, -1

    def __call__(self, measured: Floats) -> float:
        """Return the PWM fraction to hold until the next sample; measured: (4,) x, th, v, w."""
        state = self._observer.correct(measured, self._command)
        self._place, turn = self._find_place(state)
        run, planned = self._follow_plan(turn)
        for _ in range(ROUNDS):
            run = self._improve(run, planned)
        self._command = float(run.commands[0])
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

    def _improve(self, run: Run, planned: Floats) -> Run:
        """Return a run with more smooth reward and value, or the same run."""
        value = self._value_at(run, planned)
        policy = compute_policy(
            self._runner, run, self._task, self._remembered, ROUNDNESS, WEIGHT, value
        )
        start = run.make_snapshot(0)
        tried = self._runner.follow(run.commands, run.true, policy.way, policy.gains, start)
        return max([run, *tried], key=lambda other: self._rate(other, planned))

    def _value_at(self, run: Run, planned: Floats) -> Value:
        """Return the cost ahead, as a quadratic about the end of a run."""
        value = self._policy.get_value(self._place + self._horizon)
        away = self._measure_distance(run, planned)
        return Value(value.gradient + value.hessian @ away, value.hessian)

    def _rate(self, run: Run, planned: Floats) -> float:
        """Return the smooth reward of a run and what the plan promises after it."""
        if not np.isfinite(run.true).all():
            return -math.inf
        value = self._policy.get_value(self._place + self._horizon)
        away = self._measure_distance(run, planned)
        ahead = value.gradient @ away + 0.5 * away @ value.hessian @ away
        smooth = compute_smooth_reward(run.shown[1:], self._task, ROUNDNESS)[0]
        return float(smooth.sum() - ahead)

    def _measure_distance(self, run: Run, planned: Floats) -> Floats:
        """Return the distance of a run's end from the plan, past commands included."""
        end = self._place + self._horizon
        now, then = run.commands, self._plan.commands[:end]
        past = [now[-1 - j] - then[-1 - j] for j in range(self._remembered)]
        return np.concatenate([run.true[-1] - planned, past])
