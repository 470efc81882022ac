"""Play plans on twins before they are played on a rig: many lanes side by side, the loop that centres the cart closed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pendulum_sysid.records import Ints
from pendulum_twin import kernel
from pendulum_twin.effects import CATALOGUE
from pendulum_twin.effects.effect import Form
from pendulum_twin.plans.excitation import Excitation, next_command, way_of
from pendulum_twin.signals import Floats, Mask, Signals
from pendulum_twin.simulate import RATES, measured, memory_offsets, paces, report, reporting, run_mechanics
from pendulum_twin.stepper import HANGING
from pendulum_twin.words import active

_FILTERS = np.array([e.form is Form.FILTER for e in CATALOGUE])


@dataclass(frozen=True)
class Lanes:
    """Hold where twins are in their plans, one lane each.

    words: (lanes, SIZE). true, shown: (lanes, 4) states, and what the sensors show of them. memory: of each lane's command
    and drive. sample: the plan's next. start_m: (lanes,) cart at the plan's start. way: of each lane, see `way_of`; None
    until it is known.
    """

    words: Floats
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
            words=self.words[chosen],
            true=self.true[chosen],
            shown=self.shown[chosen],
            memory=tuple(self.memory[k].copy() for k in chosen),
            start_m=self.start_m[chosen],
            way=tuple(self.way[k] for k in chosen),
        )


@dataclass(frozen=True)
class Played:
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


def hanging(words: Floats, period_s: float) -> Lanes:
    """Return twins with words (lanes, SIZE) at the begin of their plans, as after a reset: truly at rest in the middle."""
    true = np.repeat(np.array([HANGING]), len(words), axis=0)
    shown = measured(true, words, np.zeros(len(words)))
    sub = kernel.substeps(period_s)
    memory = tuple(np.zeros(memory_offsets(period_s / sub * float(paces(one)))[-1]) for one in words)
    return Lanes(words, period_s, true, shown, memory, 0, shown[:, 0].copy(), (None,) * len(words))


def played(lanes: Lanes, plans: Sequence[Excitation], samples: int) -> Played:
    """Return so many samples of each lane's plan, from where the lanes are."""
    count, sub = len(lanes.words), kernel.substeps(lanes.period_s)
    commands, states = np.empty((count, samples)), np.empty((count, samples, 4))
    true, shown, way = lanes.true.copy(), lanes.shown.copy(), list(lanes.way)
    memory = tuple(one.copy() for one in lanes.memory)
    drive, out = np.empty((count, sub)), np.empty((count, 2, 4))
    lane_of, begin = np.arange(count), np.zeros(count, dtype=np.int64)
    reports = reporting(lanes.words)
    drives = [_drive_of(words, lanes.period_s / sub) for words in lanes.words]
    for n in range(samples):
        k = lanes.sample + n
        for i, plan in enumerate(plans):
            if way[i] is None and plan.push_ends is not None and k >= plan.push_ends:
                way[i] = way_of(shown[i, 0] - lanes.start_m[i])
            commands[i, n] = next_command(plan, k, shown[i, 0], shown[i, 2], way[i] or 0)
        states[:, n] = shown
        _driven(drives, commands[:, n], memory, k * sub, drive)
        run_mechanics(drive, lane_of, begin, true, lanes.words, lanes.period_s / sub, sub, out)
        true = out[:, 1].copy()
        now = measured(true, lanes.words, np.full(count, (k + 1) * lanes.period_s))
        if reports:
            now[:, RATES] = report(now[:, RATES], shown[:, RATES], lanes.words, reports, lanes.period_s)
        shown = now
    after = replace(lanes, true=true, shown=shown, memory=memory, sample=lanes.sample + samples, way=tuple(way))
    return Played(commands, states, after)


@dataclass(frozen=True)
class _Drive:
    """Hold what one lane's drive needs at every sample: whether anything filters the command, and how."""

    words: Floats
    on: Mask
    filters: bool
    h: float
    offsets: Ints


def _drive_of(words: Floats, h: float) -> _Drive:
    on, h = active(words), h * float(paces(words))
    return _Drive(words, on, bool(np.any(on & _FILTERS)), h, memory_offsets(h))


def _driven(drives: list[_Drive], commands: Floats, memory: tuple[Floats, ...], first_step: int, out: Floats) -> None:
    """Fill out, (lanes, substeps), with what each lane's drive makes of its command."""
    for i, one in enumerate(drives):
        out[i] = commands[i]
        if one.filters:
            kernel.drive(
                commands[i : i + 1], memory[i], one.offsets, one.h, out.shape[1], first_step, one.words, one.on, out[i]
            )
