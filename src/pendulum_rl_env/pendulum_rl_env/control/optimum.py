"""Find the largest reward that a task pays on a twin, and the commands that earn it.

Plans of the classical controller's swing-ups are improved until nothing more is gained; the best
plan is a local optimum, and the starts that reach it say how sure it is. The result is a reward
that some commands do earn: a larger reward cannot be excluded.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np

from pendulum_rl_env.control.classical import Classical, Plant, Tuning
from pendulum_rl_env.control.design import run_controller
from pendulum_rl_env.control.rollouts import Run, TwinRunner
from pendulum_rl_env.control.swing_up import SwingUp
from pendulum_rl_env.control.trajectory import Policy, compute_policy, improve_plan, sum_rewards
from pendulum_rl_env.kernel_transport import KernelTransport
from pendulum_rl_env.transport import Sample
from pendulum_twin.arrays import Floats

ROUNDNESS = (1.0, 0.1, 0.01)  # of the reward's corners, in turn
ROUNDS = 60  # of improvement, for each roundness
DIFFERENT_S = 0.25  # between the swing-ups of two starts, where not the direction differs
UPRIGHT_RAD = 0.3
SAME_REWARD = 0.5  # starts that end so near the best have found the same
VALUE_WEIGHT = 1e-2  # of the square of a change of command, for the feedback around the plan


@dataclass(frozen=True)
class Optimum:
    """Hold the best plan and what it earns.

    run: the plan and its states.
    reward: of the whole episode, by the task.
    starts: what the plans earned that were improved.
    ends: what each of them earned afterwards.
    """

    run: Run
    reward: float
    starts: tuple[float, ...]
    ends: tuple[float, ...]

    @property
    def agreeing(self) -> int:
        """Return how many starts ended at the best reward."""
        return sum(end > self.reward - SAME_REWARD for end in self.ends)


class _Recorder:
    """Keep the commands that a controller gives to a twin."""

    def __init__(self, transport: KernelTransport) -> None:
        self.step_s, self._transport = transport.step_s, transport
        self.commands: list[float] = []

    def reset(self) -> Sample:
        self.commands = []
        return self._transport.reset()

    def exchange(self, command: float) -> Sample:
        self.commands.append(command)
        return self._transport.exchange(command)

    def close(self) -> None:
        self._transport.close()


def count_remembered(plant: Plant) -> int:
    """Return how many past commands the drive remembers."""
    return len(plant.linear.drive) - 1


def find_optimum(
    plant: Plant, starts: int = 4, say: Callable[[str], None] = lambda line: None
) -> Optimum:
    """Return the best plan found for an episode from hanging at rest.

    plant: the twin and its task.
    starts: how many different swing-ups are improved.
    say: takes a line about every start.
    """
    task = plant.task
    runner = TwinRunner(plant.twin, task.step_s, task.pwm_limit)
    chosen = _choose_starts(plant, runner, starts)
    best, ends = chosen[0], []
    for run in chosen:
        improved = _improve(runner, run, plant)
        ends.append(sum_rewards(improved, task))
        say(f"a start of {sum_rewards(run, task):.1f} ends at {ends[-1]:.2f}")
        if ends[-1] >= max(ends):
            best = improved
    rewards = tuple(sum_rewards(run, task) for run in chosen)
    return Optimum(best, sum_rewards(best, task), rewards, tuple(ends))


def compute_feedback(plant: Plant, runner: TwinRunner, run: Run, roundness: float) -> Policy:
    """Return feedback and value around a plan."""
    remembered = count_remembered(plant)
    return compute_policy(runner, run, plant.task, remembered, roundness, VALUE_WEIGHT)


def _improve(runner: TwinRunner, run: Run, plant: Plant) -> Run:
    best = run
    for roundness in ROUNDNESS:
        better, run = improve_plan(
            runner, run, plant.task, count_remembered(plant), roundness, ROUNDS
        )
        best = max(best, better, key=lambda plan: sum_rewards(plan, plant.task))
    return best


def _choose_starts(plant: Plant, runner: TwinRunner, count: int) -> list[Run]:
    """Return so many runs of swing-ups that differ, the best first."""
    runs = []
    recorder = _Recorder(KernelTransport(plant.twin, plant.task.step_s))
    for gain, pull, first in product((4.0, 16.0), (1.0, 4.0, 10.0), (1.0, -1.0)):
        tuning = Tuning(swing=SwingUp(gain=gain, pull=pull, first=first))
        run_controller(recorder, Classical(plant, tuning), plant.task)
        padded = np.zeros(plant.task.steps)
        padded[: len(recorder.commands)] = recorder.commands
        runs.append(runner.run(padded, runner.hang()))
    runs.sort(key=lambda run: -sum_rewards(run, plant.task))
    chosen: list[Run] = []
    for run in runs:
        if all(_differ(run, other, plant.task.step_s) for other in chosen):
            chosen.append(run)
    return [*chosen, *(run for run in runs if not any(run is other for other in chosen))][:count]


def _differ(run: Run, other: Run, step_s: float) -> bool:
    """Tell whether two runs swing up in different ways."""
    (turn, arrival), (other_turn, other_arrival) = _describe_swing(run), _describe_swing(other)
    return turn != other_turn or abs(arrival - other_arrival) * step_s > DIFFERENT_S


def _describe_swing(run: Run) -> tuple[int, int]:
    """Return the turn at which a run ends, and the step of its first upright."""
    angle: Floats = run.shown[:, 1]
    turn = round(float(angle[-1]) / (2 * np.pi))
    near = np.abs(np.remainder(angle + np.pi, 2 * np.pi) - np.pi) < UPRIGHT_RAD
    return turn, int(np.argmax(near)) if near.any() else len(angle)
