"""Run a twin along a plan of commands on the kernel, and differentiate each of its periods.

Everything that a twin has is in a period: delays, lag, dead zones, dry friction, measured laws.
The drive remembers past commands; they count as a part of the state.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pendulum_rl_env.kernel_transport import count_samples
from pendulum_twin import lanes as live
from pendulum_twin.arrays import Floats, Ints
from pendulum_twin.machine_code import make_cached_compiler
from pendulum_twin.model import Twin
from pendulum_twin.sensors import apply_sensors

STATE_STEP, COMMAND_STEP = 1e-4, 1e-3  # m, rad, m/s, rad/s; and PWM fraction: of differences
STEP_SHARES: Floats = 2.0 ** -np.arange(
    live.kernel.WIDTH, dtype=np.float64
)  # of a change of plan that are tried at once

compiled = make_cached_compiler(Path(__file__))


@dataclass(frozen=True)
class Snapshot:
    """Hold a live twin between two periods.

    true, shown: (4,) true and measured x, th, v, w.
    memory: of the drive.
    path: (PATH_SIZE,) what the twin remembers of its path.
    done: substeps since the episode began.
    """

    true: Floats
    shown: Floats
    memory: Floats
    path: Floats
    done: int


def take_snapshot(lanes: live.Lanes) -> Snapshot:
    """Return the twin of the first lane as it is now."""
    return Snapshot(
        lanes.true[0].copy(),
        lanes.shown[0].copy(),
        lanes.memory[0].copy(),
        lanes.path_memory[0].copy(),
        int(lanes.done[0]),
    )


@dataclass(frozen=True)
class Run:
    """Hold what a plan of n commands does.

    commands: (n,) PWM fractions.
    true, shown: (n + 1, 4) states, the first before the first command.
    memory: (n + 1, ...) of the drive.
    path: (n + 1, PATH_SIZE) what the twin remembers of its path.
    done: (n + 1,) substeps since the episode began.
    """

    commands: Floats
    true: Floats
    shown: Floats
    memory: Floats
    path: Floats
    done: Ints

    def make_snapshot(self, k: int) -> Snapshot:
        """Return the twin before command k."""
        done = int(self.done[k])
        return Snapshot(self.true[k], self.shown[k], self.memory[k], self.path[k], done)


@dataclass(frozen=True)
class Slopes:
    """Hold the derivatives along a run of n commands, whose state is x, th, v, w and m commands.

    state: (n, 4, 4) of the true state after a period by the true state before it.
    command: (n, m + 1, 4) of the true state after period k by the command of period k - j, at a
        given state before period k.
    """

    state: Floats
    command: Floats


@compiled
def _follow_plans(  # type: ignore[no-untyped-def]
    code, kinds, lanes, timing, plan, way, gains, shares, limit, out
):
    """Run lane i by the commands of the plan, shares[i] of their change, and feedback."""
    planned, reference = plan
    commands, true, shown, memory, path, done = out
    n, m = len(planned), gains.shape[1] - 4
    applied = np.empty(len(shares))
    for k in range(n):
        for i in range(len(shares)):
            u = planned[k] + shares[i] * way[k]
            for j in range(4):
                u += gains[k, j] * (lanes.true[i, j] - reference[k, j])
            for j in range(min(m, k)):
                u += gains[k, 4 + j] * (commands[i, k - 1 - j] - planned[k - 1 - j])
            applied[i] = min(max(u, -limit), limit)
            commands[i, k] = applied[i]
        live.advance_lanes(code, kinds, lanes, timing, applied)
        for i in range(len(shares)):
            true[i, k + 1] = lanes.true[i]
            shown[i, k + 1] = lanes.shown[i]
            memory[i, k + 1] = lanes.memory[i]
            path[i, k + 1] = lanes.path_memory[i]
            done[i, k + 1] = lanes.done[i]


class TwinRunner:
    """Run one twin, by itself or many times at once, from any snapshot.

    twin: recording effects are left out.
    step_s: s; from command to command.
    limit: PWM fraction; the largest command.
    """

    def __init__(self, twin: Twin, step_s: float, limit: float) -> None:
        self._twin = twin.drop_recording_effects()
        self.limit = min(limit, twin.rig.pwm_limit or limit)
        self._timing = live.make_timing(step_s, count_samples(step_s))
        self.kinds = live.make_kinds([self._twin], self._timing)
        self._step_s = step_s
        self._lanes: dict[int, live.Lanes] = {}

    def hang(self) -> Snapshot:
        """Return the twin hanging at rest in the middle, its drive still."""
        lanes = self._get_lanes(1)
        live.begin_lane_from_python(self.kinds, lanes, self._timing, 0, 0, live.AT_REST)
        return take_snapshot(lanes)

    def run(self, commands: Floats, start: Snapshot) -> Run:
        """Return what a plan does from a snapshot."""
        reference = np.tile(start.true, (len(commands), 1))
        nothing = np.zeros(len(commands))
        gains = np.zeros((len(commands), 4))
        return self.follow(commands, reference, nothing, gains, start, np.zeros(1))[0]

    def follow(
        self,
        commands: Floats,
        reference: Floats,
        way: Floats,
        gains: Floats,
        start: Snapshot,
        shares: Floats = STEP_SHARES,
    ) -> list[Run]:
        """Return a run for each share of a change of plan.

        commands: (n,) of the plan.
        reference: (n or more, 4) true states of the plan.
        way: (n,) change of the commands.
        gains: (n, 4 + m) of the distances from the plan in state and last m commands.
        start: where every run begins.
        shares: (runs,) of the change.
        """
        n, count = len(commands), len(shares)
        lanes = self._get_lanes(count)
        lanes.true[:], lanes.shown[:] = start.true, start.shown
        lanes.memory[:], lanes.done[:] = start.memory, start.done
        lanes.path_memory[:] = start.path
        out = (
            np.zeros((count, n)),
            np.zeros((count, n + 1, 4)),
            np.zeros((count, n + 1, 4)),
            np.zeros((count, n + 1, lanes.memory.shape[1])),
            np.zeros((count, n + 1, lanes.path_memory.shape[1])),
            np.zeros((count, n + 1), dtype=np.int64),
        )
        begun = (start.true, start.shown, start.memory, start.path)
        for room, first in zip(out[1:5], begun, strict=True):
            room[:, 0] = first
        out[5][:, 0] = start.done
        code = live.select_lane_code(self.kinds, count)
        plan = np.ascontiguousarray(commands), np.ascontiguousarray(reference)
        _follow_plans(
            code, self.kinds, lanes, self._timing, plan, way, gains, shares, self.limit, out
        )
        return [Run(*(room[i] for room in out)) for i in range(count)]

    def differentiate(self, run: Run, remembered: int) -> Slopes:
        """Return the derivatives of every period of a run, by central differences.

        remembered: how many past commands the drive remembers.
        """
        n = len(run.commands)
        asides = np.concatenate([STATE_STEP * np.eye(4), -STATE_STEP * np.eye(4)])
        states = np.empty((8, n, 4))
        for row, aside in zip(states, asides, strict=True):
            row[:] = run.true[:-1] + aside
        after = self._advance(run, states.reshape(-1, 4), np.tile(run.commands, 8), 8)
        after = after.reshape(2, 4, n, 4)
        state = np.moveaxis((after[0] - after[1]) / (2 * STATE_STEP), 0, 2)  # (n, after, before)
        return Slopes(state, self._differentiate_by_commands(run, remembered))

    def _differentiate_by_commands(self, run: Run, remembered: int) -> Floats:
        n = len(run.commands)
        slopes = np.zeros((n, remembered + 1, 4))
        u = np.concatenate([run.commands + COMMAND_STEP, run.commands - COMMAND_STEP])
        after = self._advance(run, np.tile(run.true[:-1], (2, 1)), u, 2)
        lanes = self._get_lanes(2 * n)
        code = live.select_lane_code(self.kinds, 2 * n)
        for j in range(remembered + 1):
            difference = (after[:n] - after[n:]) / (2 * COMMAND_STEP)
            slopes[j:, j] = difference[: n - j]
            if j == remembered:
                break
            # the next period, from the run's own state: what the drive still remembers
            later = np.minimum(np.arange(n) + j + 1, n - 1)
            lanes.true[:] = np.tile(run.true[later], (2, 1))
            u = np.tile(run.commands[later], 2)
            live.advance_lanes_from_python(code, self.kinds, lanes, self._timing, u)
            after = lanes.true.copy()
        return slopes

    def _advance(self, run: Run, states: Floats, commands: Floats, times: int) -> Floats:
        """Return the true states a period after these, each run's step `times` times over."""
        lanes = self._get_lanes(len(states))
        lanes.true[:] = states
        lanes.shown[:] = np.tile(run.shown[:-1], (times, 1))
        lanes.memory[:] = np.tile(run.memory[:-1], (times, 1))
        lanes.path_memory[:] = np.tile(run.path[:-1], (times, 1))
        lanes.done[:] = np.tile(run.done[:-1], times)
        code = live.select_lane_code(self.kinds, len(states))
        live.advance_lanes_from_python(code, self.kinds, lanes, self._timing, commands)
        return lanes.true.copy()

    def differentiate_sensors(self, run: Run) -> tuple[Floats, Floats]:
        """Return what the sensors show after each period, and its derivative.

        Reported velocities count as the sensors show them, without a filter of the report.

        Returns (n, 4) and (n, 4, 4): of measured states by true states.
        """
        true = run.true[1:]
        t_s = run.done[1:] / self._timing.sub * self._timing.sample_s
        asides = np.concatenate([[np.zeros(4)], STATE_STEP * np.eye(4), -STATE_STEP * np.eye(4)])
        states = true[None] + asides[:, None]
        theta = np.tile(self.kinds.theta[0], (9, 1))
        shown = apply_sensors(states, theta, np.tile(t_s, (9, 1)))
        slope = np.moveaxis((shown[1:5] - shown[5:]) / (2 * STATE_STEP), 0, 2)
        return shown[0], slope

    def _get_lanes(self, count: int) -> live.Lanes:
        if count not in self._lanes:
            self._lanes[count] = live.make_lanes(self.kinds, self._timing, count)
        return self._lanes[count]
