"""Put a plan together phase by phase; each phase is the best for the worst-served aim.

Every candidate is played on every twin that an aim moves, from the state in which the phases
before it leave the twin. A candidate that brings a twin too near the end of the rail, or makes it
too fast, is dropped.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.problem import Problem
from pendulum_sysid.fitting.windows import WINDOW_S
from pendulum_sysid.planning.aims import Aim
from pendulum_sysid.planning.phase_family import list_phases
from pendulum_sysid.planning.planned_run import Lanes, PlayedRun, make_hanging_lanes, play_plans
from pendulum_sysid.records import Fit, Windows
from pendulum_twin.arrays import Floats
from pendulum_twin.plans.excitation import Excitation
from pendulum_twin.plans.plan_file import Plan, make_excitation
from pendulum_twin.plans.plan_phases import Phase, Push, Rest
from pendulum_twin.plans.waveforms import Envelope

PUSH_S, REST_S, PHASE_S = 1.5, 1.5, 4.0
SHORTEST_S = PUSH_S + REST_S + 2.0


@dataclass(frozen=True)
class GrownPlan:
    """Hold a plan and what its recording adds.

    normals: the normal matrix of each aim, of the recordings at hand and of the plan together.
    values: number of samples of all channels in the plan's recording.
    """

    plan: Plan
    normals: list[Floats]
    values: int


@dataclass(frozen=True)
class Setting:
    """Hold what stays the same while a plan grows.

    case: the recordings at hand, run with a search's steps.
    pieces: number of pieces that a window is cut into.
    power: (channels,) mean squared error that counts as noise.
    aims: what the plan is to achieve.
    movers: (twins, SIZE) parameter vectors of the twins that play.
    twin_of: number of the twin that plays for each aim.
    room: limits of rail and command.
    rate_hz: rate of the plan.
    """

    case: Case
    pieces: int
    power: Floats
    aims: Sequence[Aim]
    movers: Floats
    twin_of: tuple[int, ...]
    room: Envelope
    rate_hz: float

    def make_excitation(self, phases: Sequence[Phase]) -> Excitation:
        """Return the excitation of phases."""
        return make_excitation(Plan(tuple(phases), "next", self.rate_hz), self.room)

    def is_safe(self, states: Floats) -> bool:
        """Return whether runs (..., 4) stay off the rail's ends and below a plan's speeds."""
        far, _, fast, spin = np.max(np.abs(states).reshape(-1, 4), axis=0)
        return bool(
            far <= decisions.RAIL_SHARE * self.room.half_length_m
            and fast <= decisions.PLAN_FASTEST_M_S
            and spin <= decisions.PLAN_FASTEST_RAD_S
        )

    def compute_normals(self, run: PlayedRun, first_lane: int = 0) -> list[Floats]:
        """Return the normal matrix of each aim on a run that has a lane a twin."""
        problems = [self._make_problem(run, first_lane + twin) for twin in range(len(self.movers))]
        weighed = self.power / decisions.DECIDING_SHARE
        players = {
            aim.linearisation: problems[twin]
            for aim, twin in zip(self.aims, self.twin_of, strict=True)
        }
        normals = {about: about.compute_normal(p, weighed) for about, p in players.items()}
        return [aim.turn(normals[aim.linearisation]) for aim in self.aims]

    def _make_problem(self, run: PlayedRun, lane: int) -> Problem:
        signals = run.make_signals(lane, self.case.signals)
        length = max(round(WINDOW_S / signals.period_s) // self.pieces, 1)
        begin = np.arange(0, len(signals) - length, length, dtype=np.int64)
        return replace(
            self.case.problem(Windows(begin, length + 1, run.states[lane, begin])), signals=signals
        )

    def rate_worst(self, normals: Sequence[Floats]) -> float:
        """Return how well the normal matrices serve the worst-served aim."""
        return min(aim.rate(normal) for aim, normal in zip(self.aims, normals, strict=True))


def grow_plan(
    case: Case, best: Fit, aims: Sequence[Aim], room: Envelope, seconds: float
) -> GrownPlan | None:
    """Return the plan that serves all aims best; None where every phase leads off the rail.

    best: fit whose noise and pieces the plan is judged with.
    room: limits of rail and command.
    seconds: length of the plan, SHORTEST_S at least.

    Raises BadInputError for a rate that no plan may have.
    """
    setting = _make_setting(case, best, aims, room)
    count = max(1, round((seconds - PUSH_S - REST_S) / PHASE_S))
    candidates = list_phases(room, (seconds - PUSH_S - REST_S) / count, setting.rate_hz)
    phases: list[Phase] = [Push(seconds=PUSH_S)]
    lanes = make_hanging_lanes(setting.movers, 1 / setting.rate_hz)
    pieces = [_play_last_phase(setting, phases, lanes)]
    normals = [aim.normal for aim in aims]
    for k in range(count):
        ranked = _rank_candidates(setting, phases, candidates, pieces[-1].lanes, normals)
        if not ranked:
            break
        candidates = ranked[: decisions.PHASES_REFINED] if k == 0 else candidates
        phases.append(ranked[0])
        pieces.append(_play_last_phase(setting, phases, pieces[-1].lanes))
        normals = _add_normals(normals, setting.compute_normals(pieces[-1]))
    if len(phases) == 1:
        return None
    phases.append(Rest(seconds=REST_S, centred=True))
    pieces.append(_play_last_phase(setting, phases, pieces[-1].lanes))
    joined = _join_runs(pieces)
    normals = _add_normals([aim.normal for aim in aims], setting.compute_normals(joined))
    return GrownPlan(
        Plan(tuple(phases), "next", setting.rate_hz),
        normals,
        joined.commands.shape[1] * len(setting.power),
    )


def _make_setting(case: Case, best: Fit, aims: Sequence[Aim], room: Envelope) -> Setting:
    movers, twin_of = np.unique(np.array([aim.mover for aim in aims]), axis=0, return_inverse=True)
    rate_hz = 1 / case.signals.period_s
    whole = float(round(rate_hz))
    rate_hz = whole if abs(rate_hz / whole - 1) < 0.01 else rate_hz
    return Setting(
        replace(case, step_s=decisions.SEARCH_STEP_S),
        best.pieces,
        best.power,
        aims,
        movers,
        tuple(twin_of.reshape(-1).tolist()),
        room,
        rate_hz,
    )


def _add_normals(first: Sequence[Floats], second: Sequence[Floats]) -> list[Floats]:
    return [a + b for a, b in zip(first, second, strict=True)]


def _play_last_phase(setting: Setting, phases: Sequence[Phase], lanes: Lanes) -> PlayedRun:
    """Play the last of the phases on every twin, from the end of the phases before it."""
    plan = setting.make_excitation(phases)
    return play_plans(lanes, [plan] * len(setting.movers), len(plan.commands) - lanes.sample)


def _rank_candidates(
    setting: Setting,
    phases: Sequence[Phase],
    candidates: Sequence[Phase],
    lanes: Lanes,
    normals: Sequence[Floats],
) -> list[Phase]:
    """Return the candidates that are safe on every twin, best for the worst-served aim first."""
    twins = len(setting.movers)
    plans = [setting.make_excitation([*phases, candidate]) for candidate in candidates]
    # two phases may differ by a sample in rounding
    samples = min(len(plan.commands) for plan in plans) - lanes.sample
    every = lanes.pick(np.tile(np.arange(twins), len(candidates)))
    run = play_plans(every, [plan for plan in plans for _ in range(twins)], samples)
    ratings = {
        k: setting.rate_worst(_add_normals(normals, setting.compute_normals(run, k * twins)))
        for k in range(len(candidates))
        if setting.is_safe(run.states[k * twins : (k + 1) * twins])
    }
    return [candidates[k] for k in sorted(ratings, key=lambda k: -ratings[k])]


def _join_runs(runs: Sequence[PlayedRun]) -> PlayedRun:
    commands, states = (
        np.concatenate([getattr(run, name) for run in runs], axis=1)
        for name in ("commands", "states")
    )
    return PlayedRun(commands, states, runs[-1].lanes)
