"""Improve a plan of commands by the derivatives of the twin's own periods.

Source: Tassa, Mansard and Todorov, Control-limited differential dynamic programming, ICRA 2014,
with the Gauss-Newton approximation of the dynamics (iLQR). The plan runs on the kernel and the
task's own reward judges every plan; derivatives only say where to look.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pendulum_rl_env.control.rollouts import Run, TwinRunner
from pendulum_rl_env.control.smooth_reward import compute_smooth_reward
from pendulum_rl_env.reward import compute_reward_and_end
from pendulum_rl_env.task import Task
from pendulum_twin.arrays import Floats
from pendulum_twin.machine_code import make_cached_compiler

LEAST_WEIGHT, MOST_WEIGHT = 1e-6, 1e3  # of the square of a change of command
WEIGHT_FACTOR = 3.0  # by which that weight grows after a failure and shrinks after a success
LEAST_GAIN = 1e-5  # of the smooth reward: less is no success

compiled = make_cached_compiler(Path(__file__))


@dataclass(frozen=True)
class Value:
    """Hold a quadratic value of true state and past commands z at a point of a plan.

    gradient: (4 + m,) of the reward ahead by the distance from the plan.
    hessian: (4 + m, 4 + m).
    """

    gradient: Floats
    hessian: Floats


@dataclass(frozen=True)
class Policy:
    """Hold the change of a plan of n commands, and the feedback around it.

    way: (n,) change of the commands.
    gains: (n, 4 + m) of the distances in state and past commands.
    gradients, hessians: (n + 1, ...) of the reward ahead, see `Value`.
    """

    way: Floats
    gains: Floats
    gradients: Floats
    hessians: Floats

    def get_value(self, k: int) -> Value:
        """Return the value before command k."""
        return Value(self.gradients[k], self.hessians[k])


def sum_rewards(run: Run, task: Task) -> float:
    """Return what the environment pays for a run, with the penalty where it ends early."""
    total = 0.0
    for x, th, v, w in run.shown[1:].tolist():
        reward, end = compute_reward_and_end(x, th, v, w, task.limits, task.penalties)
        total += reward
        if end:
            break
    return total


@compiled
def _sweep_back(  # type: ignore[no-untyped-def]
    state, command, planned, gradient, hessian, last, weight, limit, out
):
    """Fill way, gains and values from the last period to the first; costs are minimised."""
    way, gains, gradients, hessians = out
    n, m = command.shape[0], command.shape[1] - 1
    size = 4 + m
    gradients[n], hessians[n] = last
    a, b = np.zeros((size, size)), np.zeros(size)
    for j in range(1, m):
        a[4 + j, 3 + j] = 1.0
    if m > 0:
        b[4] = 1.0
    for k in range(n - 1, -1, -1):
        v, vv = gradients[k + 1].copy(), hessians[k + 1].copy()
        v[:4] += gradient[k]
        vv[:4, :4] += hessian[k]
        a[:4, :4] = state[k]
        for j in range(m):
            a[:4, 4 + j] = command[k, 1 + j]
        b[:4] = command[k, 0]
        vb = vv @ b
        q_u, q_uu = v @ b, vb @ b + weight
        q_z, q_uz = a.T @ v, a.T @ vb
        q_zz = a.T @ vv @ a
        du = min(max(-q_u / q_uu, -limit - planned[k]), limit - planned[k])
        way[k] = du
        gains[k] = -q_uz / q_uu
        if (du == limit - planned[k]) | (du == -limit - planned[k]):
            gains[k] = 0.0
        row = gains[k]
        gradients[k] = q_z + q_uz * du + row * (q_u + (q_uu - weight) * du)
        vz = q_zz + np.outer(row, row) * (q_uu - weight)
        vz += np.outer(q_uz, row) + np.outer(row, q_uz)
        hessians[k] = 0.5 * (vz + vz.T)


def compute_policy(
    runner: TwinRunner,
    run: Run,
    task: Task,
    remembered: int,
    roundness: float,
    weight: float,
    last: Value | None = None,
) -> Policy:
    """Return the change of a run's plan that promises the largest smooth reward.

    remembered: past commands that the drive remembers.
    roundness: of the reward's corners.
    weight: of the square of a change of command.
    last: value at the end of the run, of a cost (its sign is that of a cost); None for none.
    """
    slopes = runner.differentiate(run, remembered)
    shown, sensor = runner.differentiate_sensors(run)
    _, gradient, hessian = compute_smooth_reward(shown, task, roundness)
    gradient = np.einsum("nij,ni->nj", sensor, -gradient)
    hessian = _make_convex(np.einsum("nki,nkl,nlj->nij", sensor, -hessian, sensor))
    n, size = len(run.commands), 4 + remembered
    end = last or Value(np.zeros(size), np.zeros((size, size)))
    out = (
        np.zeros(n),
        np.zeros((n, size)),
        np.zeros((n + 1, size)),
        np.zeros((n + 1, size, size)),
    )
    _sweep_back(
        np.ascontiguousarray(slopes.state),
        np.ascontiguousarray(slopes.command),
        np.ascontiguousarray(run.commands),
        np.ascontiguousarray(gradient),
        np.ascontiguousarray(hessian),
        (end.gradient, end.hessian),
        weight,
        runner.limit,
        out,
    )
    return Policy(*out)


def _make_convex(hessian: Floats) -> Floats:
    """Return the nearest symmetric matrices (n, 4, 4) without negative eigenvalues."""
    sizes, vectors = np.linalg.eigh(0.5 * (hessian + np.swapaxes(hessian, 1, 2)))
    result: Floats = np.einsum("nij,nj,nkj->nik", vectors, np.maximum(sizes, 0.0), vectors)
    return result


def improve_plan(
    runner: TwinRunner,
    run: Run,
    task: Task,
    remembered: int,
    roundness: float,
    rounds: int,
    weight: float = 1e-2,
) -> tuple[Run, Run]:
    """Return the best run by the task's own reward, and the last run by the smooth reward.

    run: to begin with.
    rounds: changes of plan that are tried, at most.
    Others: see `compute_policy`.
    """
    best, best_reward = run, sum_rewards(run, task)
    now = _sum_smooth(run, task, roundness)
    start = run.make_snapshot(0)
    for _ in range(rounds):
        policy = compute_policy(runner, run, task, remembered, roundness, weight)
        tried = runner.follow(run.commands, run.true, policy.way, policy.gains, start)
        sums = [_sum_smooth(other, task, roundness) for other in tried]
        for other in tried:
            reward = sum_rewards(other, task)
            if reward > best_reward:
                best, best_reward = other, reward
        k = int(np.argmax(sums))
        if sums[k] > now + LEAST_GAIN:
            run, now = tried[k], sums[k]
            weight = max(weight / WEIGHT_FACTOR, LEAST_WEIGHT)
        elif weight >= MOST_WEIGHT:
            break
        else:
            weight *= WEIGHT_FACTOR**2
    return best, run


def _sum_smooth(run: Run, task: Task, roundness: float) -> float:
    if not np.isfinite(run.shown).all():
        return -np.inf
    return float(compute_smooth_reward(run.shown[1:], task, roundness)[0].sum())
