"""Put a plan together phase by phase, each time by the one that brings the worst-served aim furthest.

Every candidate is played on every twin that is in question, from where the phases before it leave
them; one in which any of them comes too near the rail's end, or becomes too fast, is out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.linearised import Problem
from pendulum_sysid.fitting.windows import WINDOW_S
from pendulum_sysid.planning.aims import Aim
from pendulum_sysid.planning.phase_family import list_phases
from pendulum_sysid.planning.planned_run import Lanes, PlayedRun, make_hanging_lanes, play_plans
from pendulum_sysid.records import Fit, Windows
from pendulum_twin.plans.excitation import Excitation
from pendulum_twin.plans.plan_file import Plan, make_excitation
from pendulum_twin.plans.plan_phases import Phase, Push, Rest
from pendulum_twin.plans.waveforms import Envelope
from pendulum_twin.signals import Floats

PUSH_S, REST_S, PHASE_S = 1.5, 1.5, 4.0
SHORTEST_S = PUSH_S + REST_S + 2.0


@dataclass(frozen=True)
class GrownPlan:
    """Hold a plan, the products of each aim with its recording added to what is at hand, and how many values it has."""

    plan: Plan
    products: list[Floats]
    values: int


@dataclass(frozen=True)
class Setting:
    """Hold what stays the same while a plan grows.

    parts: into how many a window is cut. power: (channels,) that counts as noise. movers: (twins,
    SIZE) in question.
    twin_of: which of them moves for each aim.
    """

    case: Case
    parts: int
    power: Floats
    aims: Sequence[Aim]
    movers: Floats
    twin_of: tuple[int, ...]
    room: Envelope
    rate_hz: float

    def played(self, phases: Sequence[Phase]) -> Excitation:
        """Return what is played of phases."""
        return make_excitation(Plan(tuple(phases), "next", self.rate_hz), self.room)

    def safe(self, states: Floats) -> bool:
        """Return whether runs (..., 4) keep away from the rail's ends and from speeds that stop a plan."""
        far, _, fast, spin = np.max(np.abs(states).reshape(-1, 4), axis=0)
        return bool(
            far <= decisions.RAIL_SHARE * self.room.half_length_m
            and fast <= decisions.PLAN_FASTEST_M_S
            and spin <= decisions.PLAN_FASTEST_RAD_S
        )

    def added(self, run: PlayedRun, first_lane: int = 0) -> list[Floats]:
        """Return what a run, with one lane a twin, adds to each aim's products."""
        problems = [self._problem(run, first_lane + twin) for twin in range(len(self.movers))]
        weighed = self.power / decisions.DECIDING_SHARE
        return [
            aim.products(problems[twin], weighed)
            for aim, twin in zip(self.aims, self.twin_of, strict=True)
        ]

    def _problem(self, run: PlayedRun, lane: int) -> Problem:
        signals = run.signals(lane, self.case.signals)
        length = max(round(WINDOW_S / signals.period_s) // self.parts, 1)
        begin = np.arange(0, len(signals) - length, length, dtype=np.int64)
        return replace(
            self.case.problem(Windows(begin, length + 1, run.states[lane, begin])), signals=signals
        )

    def worst(self, products: Sequence[Floats]) -> float:
        """Return how well the worst-served aim is served."""
        return min(aim.worth(one) for aim, one in zip(self.aims, products, strict=True))


def grow_plan(
    case: Case, best: Fit, aims: Sequence[Aim], room: Envelope, seconds: float, seed: int
) -> GrownPlan | None:
    """Return the plan of so many seconds (SHORTEST_S at least) that serves all aims best.

    None where every phase leads off the rail. Raises BadInputError for a rate that no plan may
    have.
    """
    setting = _make_setting(case, best, aims, room)
    count = max(1, round((seconds - PUSH_S - REST_S) / PHASE_S))
    candidates = list_phases(room, (seconds - PUSH_S - REST_S) / count, setting.rate_hz, seed)
    phases: list[Phase] = [Push(seconds=PUSH_S)]
    parts = [
        _play_last_phase(setting, phases, make_hanging_lanes(setting.movers, 1 / setting.rate_hz))
    ]
    have = [aim.normal for aim in aims]
    for k in range(count):
        ranked = _rank_candidates(setting, phases, candidates, parts[-1].lanes, have)
        if not ranked:
            break
        candidates = ranked[: decisions.PHASES_REFINED] if k == 0 else candidates
        phases.append(ranked[0])
        parts.append(_play_last_phase(setting, phases, parts[-1].lanes))
        have = _add_products(have, setting.added(parts[-1]))
    if len(phases) == 1:
        return None
    phases.append(Rest(seconds=REST_S, centred=True))
    parts.append(_play_last_phase(setting, phases, parts[-1].lanes))
    whole = _join_runs(parts)
    products = _add_products([aim.normal for aim in aims], setting.added(whole))
    return GrownPlan(
        Plan(tuple(phases), "next", setting.rate_hz),
        products,
        whole.commands.shape[1] * len(setting.power),
    )


def _make_setting(case: Case, best: Fit, aims: Sequence[Aim], room: Envelope) -> Setting:
    movers, twin_of = np.unique(np.array([aim.mover for aim in aims]), axis=0, return_inverse=True)
    rate_hz = 1 / case.signals.period_s
    whole = float(round(rate_hz))
    rate_hz = whole if abs(rate_hz / whole - 1) < 0.01 else rate_hz
    return Setting(
        case,
        best.parts,
        best.power,
        aims,
        movers,
        tuple(twin_of.reshape(-1).tolist()),
        room,
        rate_hz,
    )


def _add_products(first: Sequence[Floats], second: Sequence[Floats]) -> list[Floats]:
    return [a + b for a, b in zip(first, second, strict=True)]


def _play_last_phase(setting: Setting, phases: Sequence[Phase], lanes: Lanes) -> PlayedRun:
    """Return the last of the phases played on every twin, from where the phases before it leave them."""
    plan = setting.played(phases)
    return play_plans(lanes, [plan] * len(setting.movers), len(plan.commands) - lanes.sample)


def _rank_candidates(
    setting: Setting,
    phases: Sequence[Phase],
    candidates: Sequence[Phase],
    lanes: Lanes,
    have: Sequence[Floats],
) -> list[Phase]:
    """Return the candidates that are safe on every twin, the one that serves the worst-served aim best first."""
    twins = len(setting.movers)
    plans = [setting.played([*phases, one]) for one in candidates]
    samples = (
        min(len(plan.commands) for plan in plans) - lanes.sample
    )  # two phases may differ by a sample in rounding
    every = lanes.of(np.tile(np.arange(twins), len(candidates)))
    run = play_plans(every, [plan for plan in plans for _ in range(twins)], samples)
    worths = {
        k: setting.worst(_add_products(have, setting.added(run, k * twins)))
        for k in range(len(candidates))
        if setting.safe(run.states[k * twins : (k + 1) * twins])
    }
    return [candidates[k] for k in sorted(worths, key=lambda k: -worths[k])]


def _join_runs(parts: Sequence[PlayedRun]) -> PlayedRun:
    commands, states = (
        np.concatenate([getattr(one, name) for one in parts], axis=1)
        for name in ("commands", "states")
    )
    return PlayedRun(commands, states, parts[-1].lanes)
