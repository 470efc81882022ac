"""Play plans on twins: many lanes side by side, with the loop closed that centres the cart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pendulum_twin import kernel
from pendulum_twin.arrays import Floats, Ints, Mask
from pendulum_twin.block import PATH_SIZE
from pendulum_twin.effects import CATALOGUE
from pendulum_twin.effects.effect import Form
from pendulum_twin.free_runs import compute_memory_offsets
from pendulum_twin.mechanics import run_mechanics
from pendulum_twin.parameter_vector import find_active_effects, list_law_kinds
from pendulum_twin.plans.excitation import Excitation, compute_command, find_command_direction
from pendulum_twin.sensors import (
    RATES,
    apply_sensors,
    compute_paces,
    report_rates,
    select_reporting_effects,
)
from pendulum_twin.signals import Signals
from pendulum_twin.stepper import HANGING

_FILTERS = np.array([e.form is Form.FILTER for e in CATALOGUE])


@dataclass(frozen=True)
class Lanes:
    """Hold the states of twins in their plans, a lane a twin.

    theta: (lanes, SIZE) parameter vectors.
    period_s: sample period.
    true: (lanes, 4) states: cart (m), pole (rad), and their velocities.
    shown: (lanes, 4) the states as the sensors show them.
    path_memory: (lanes, PATH_SIZE) what the lanes remember of their paths.
    memory: what command and drive of each lane keep between substeps.
    sample: number of the next sample of the plan.
    start_m: (lanes,) cart position at the start of the plan.
    way: direction of the command in each lane, see `find_command_direction`; None until known.
    """

    theta: Floats
    period_s: float
    true: Floats
    shown: Floats
    path_memory: Floats
    memory: tuple[Floats, ...]
    sample: int
    start_m: Floats
    way: tuple[int | None, ...]

    def pick(self, chosen: Ints) -> Lanes:
        """Return the chosen lanes, which go on from here; a lane may be chosen several times."""
        return replace(
            self,
            theta=self.theta[chosen],
            true=self.true[chosen],
            shown=self.shown[chosen],
            path_memory=self.path_memory[chosen],
            memory=tuple(self.memory[k].copy() for k in chosen),
            start_m=self.start_m[chosen],
            way=tuple(self.way[k] for k in chosen),
        )


@dataclass(frozen=True)
class PlayedRun:
    """Hold a run of plans.

    commands: (lanes, n) what was sent.
    states: (lanes, n, 4) what the sensors showed.
    lanes: where the lanes are after the run.
    """

    commands: Floats
    states: Floats
    lanes: Lanes

    def make_signals(self, lane: int, like: Signals | None = None) -> Signals:
        """Return a lane as signals; `like` says which joints are kept, None for both."""
        every = np.ones(self.commands.shape[1], dtype=bool)
        cart, pole = self.states[lane, :, 0], self.states[lane, :, 1]
        return Signals(
            self.lanes.period_s,
            self.commands[lane],
            cart if like is None or like.cart is not None else None,
            pole if like is None or like.pole is not None else None,
            every,
            every,
        )


def make_hanging_lanes(theta: Floats, period_s: float) -> Lanes:
    """Return lanes at the start of their plans: at rest in the middle, as after a reset."""
    true = np.repeat(np.array([HANGING]), len(theta), axis=0)
    shown = apply_sensors(true, theta, np.zeros(len(theta)))
    sub = kernel.count_substeps(period_s)
    memory = tuple(
        np.zeros(compute_memory_offsets(period_s / sub * float(compute_paces(lane)))[-1])
        for lane in theta
    )
    count, paths = len(theta), np.zeros((len(theta), PATH_SIZE))
    return Lanes(
        theta, period_s, true, shown, paths, memory, 0, shown[:, 0].copy(), (None,) * count
    )


def play_plans(lanes: Lanes, plans: Sequence[Excitation], samples: int) -> PlayedRun:
    """Play the next samples of each lane's plan."""
    count, sub = len(lanes.theta), kernel.count_substeps(lanes.period_s)
    commands, states = np.empty((count, samples)), np.empty((count, samples, 4))
    true, shown, way = lanes.true.copy(), lanes.shown.copy(), list(lanes.way)
    memory = tuple(values.copy() for values in lanes.memory)
    path_memory = lanes.path_memory.copy()
    drive, out = np.empty((count, sub)), np.empty((count, 2, 4))
    lane_of, begin = np.arange(count), np.zeros(count, dtype=np.int64)
    reports = select_reporting_effects(lanes.theta)
    drives = [_make_drive(theta, lanes.period_s / sub) for theta in lanes.theta]
    for n in range(samples):
        k = lanes.sample + n
        for i, plan in enumerate(plans):
            if way[i] is None and plan.push_ends is not None and k >= plan.push_ends:
                way[i] = find_command_direction(shown[i, 0] - lanes.start_m[i])
            commands[i, n] = compute_command(plan, k, shown[i, 0], shown[i, 2], way[i] or 0)
        states[:, n] = shown
        _drive_lanes(drives, commands[:, n], memory, k * sub, drive)
        run_mechanics(
            drive,
            lane_of,
            begin,
            begin + k * sub,
            true,
            lanes.theta,
            lanes.period_s / sub,
            sub,
            out,
            path_memory=path_memory,
        )
        true = out[:, 1].copy()
        now = apply_sensors(true, lanes.theta, np.full(count, (k + 1) * lanes.period_s))
        if reports:
            now[:, RATES] = report_rates(
                now[:, RATES], shown[:, RATES], lanes.theta, reports, lanes.period_s
            )
        shown = now
    after = replace(
        lanes,
        true=true,
        shown=shown,
        memory=memory,
        path_memory=path_memory,
        sample=lanes.sample + samples,
        way=tuple(way),
    )
    return PlayedRun(commands, states, after)


@dataclass(frozen=True)
class _Drive:
    """Hold what the drive of a lane needs at every sample.

    filters: whether any effect filters the command.
    h: substep in s, of the time of the lane.
    offsets: places of the effects in the memory.
    """

    theta: Floats
    on: Mask
    filters: bool
    h: float
    offsets: Ints


def _make_drive(theta: Floats, h: float) -> _Drive:
    on, h = find_active_effects(theta), h * float(compute_paces(theta))
    filters = bool(np.any(on & _FILTERS)) or bool(list_law_kinds(theta))
    return _Drive(theta, on, filters, h, compute_memory_offsets(h))


def _drive_lanes(
    drives: list[_Drive],
    commands: Floats,
    memory: tuple[Floats, ...],
    first_step: int,
    out: Floats,
) -> None:
    """Fill `out` (lanes, substeps) with what the drive of each lane makes of its command."""
    for i, lane in enumerate(drives):
        out[i] = commands[i]
        if lane.filters:
            kernel.filter_command(
                commands[i : i + 1],
                memory[i],
                lane.offsets,
                lane.h,
                out.shape[1],
                first_step,
                lane.theta,
                lane.on,
                out[i],
            )
