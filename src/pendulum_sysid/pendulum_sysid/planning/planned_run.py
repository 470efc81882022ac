"""Play plans on twins before they are played on a rig: many lanes side by side, the loop that centres the cart closed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pendulum_sysid.records import Ints
from pendulum_twin import kernel
from pendulum_twin.effects import CATALOGUE
from pendulum_twin.effects.effect import Form
from pendulum_twin.parameter_vector import find_active_effects
from pendulum_twin.plans.excitation import Excitation, compute_command, find_command_direction
from pendulum_twin.signals import Floats, Mask, Signals
from pendulum_twin.simulate import (
    RATES,
    apply_sensors,
    compute_memory_offsets,
    compute_paces,
    report_rates,
    run_mechanics,
    select_reporting_effects,
)
from pendulum_twin.stepper import HANGING

_FILTERS = np.array([e.form is Form.FILTER for e in CATALOGUE])


@dataclass(frozen=True)
class Lanes:
    """Hold where twins are in their plans, one lane each.

    theta: (lanes, SIZE). true, shown: (lanes, 4) states, and what the sensors show of them.
    memory: of each lane's command and drive. sample: the plan's next. start_m: (lanes,) cart at
    the plan's start. way: of each lane, see `find_command_direction`; None until it is known.
    """

    theta: Floats
    period_s: float
    true: Floats
    shown: Floats
    memory: tuple[Floats, ...]
    sample: int
    start_m: Floats
    way: tuple[int | None, ...]

    def of(self, chosen: Ints) -> Lanes:
        """Return lanes that go on from where these are; one may be chosen several times."""
        return replace(
            self,
            theta=self.theta[chosen],
            true=self.true[chosen],
            shown=self.shown[chosen],
            memory=tuple(self.memory[k].copy() for k in chosen),
            start_m=self.start_m[chosen],
            way=tuple(self.way[k] for k in chosen),
        )


@dataclass(frozen=True)
class PlayedRun:
    """Hold what was sent, (lanes, n), and what the sensors showed, (lanes, n, 4), and where the lanes are now."""

    commands: Floats
    states: Floats
    lanes: Lanes

    def signals(self, lane: int, like: Signals | None = None) -> Signals:
        """Return one lane as a recording, with the joints of another one, or with both."""
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
    """Return twins with words (lanes, SIZE) at the begin of their plans, as after a reset: truly at rest in the middle."""
    true = np.repeat(np.array([HANGING]), len(theta), axis=0)
    shown = apply_sensors(true, theta, np.zeros(len(theta)))
    sub = kernel.count_substeps(period_s)
    memory = tuple(
        np.zeros(compute_memory_offsets(period_s / sub * float(compute_paces(one)))[-1])
        for one in theta
    )
    return Lanes(theta, period_s, true, shown, memory, 0, shown[:, 0].copy(), (None,) * len(theta))


def play_plans(lanes: Lanes, plans: Sequence[Excitation], samples: int) -> PlayedRun:
    """Return so many samples of each lane's plan, from where the lanes are."""
    count, sub = len(lanes.theta), kernel.count_substeps(lanes.period_s)
    commands, states = np.empty((count, samples)), np.empty((count, samples, 4))
    true, shown, way = lanes.true.copy(), lanes.shown.copy(), list(lanes.way)
    memory = tuple(one.copy() for one in lanes.memory)
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
        run_mechanics(drive, lane_of, begin, true, lanes.theta, lanes.period_s / sub, sub, out)
        true = out[:, 1].copy()
        now = apply_sensors(true, lanes.theta, np.full(count, (k + 1) * lanes.period_s))
        if reports:
            now[:, RATES] = report_rates(
                now[:, RATES], shown[:, RATES], lanes.theta, reports, lanes.period_s
            )
        shown = now
    after = replace(
        lanes, true=true, shown=shown, memory=memory, sample=lanes.sample + samples, way=tuple(way)
    )
    return PlayedRun(commands, states, after)


@dataclass(frozen=True)
class _Drive:
    """Hold what one lane's drive needs at every sample: whether anything filters the command, and how."""

    theta: Floats
    on: Mask
    filters: bool
    h: float
    offsets: Ints


def _make_drive(theta: Floats, h: float) -> _Drive:
    on, h = find_active_effects(theta), h * float(compute_paces(theta))
    return _Drive(theta, on, bool(np.any(on & _FILTERS)), h, compute_memory_offsets(h))


def _drive_lanes(
    drives: list[_Drive],
    commands: Floats,
    memory: tuple[Floats, ...],
    first_step: int,
    out: Floats,
) -> None:
    """Fill out, (lanes, substeps), with what each lane's drive makes of its command."""
    for i, one in enumerate(drives):
        out[i] = commands[i]
        if one.filters:
            kernel.drive(
                commands[i : i + 1],
                memory[i],
                one.offsets,
                one.h,
                out.shape[1],
                first_step,
                one.theta,
                one.on,
                out[i],
            )
