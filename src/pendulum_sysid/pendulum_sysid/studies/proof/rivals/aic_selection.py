"""Forward selection by Akaike's criterion on free runs: add the effect that lowers it most until none does.

Akaike, IEEE Trans. Automatic Control 19 (1974) 716, with Gaussian errors of unknown variance in
each channel. Every candidate is fitted in full at every step; nothing is kept for choosing,
nothing pruned.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from pendulum_sysid.fitting.gauss_newton import Solution, solve
from pendulum_sysid.fitting.parameters import free_parameters, size_of
from pendulum_sysid.fitting.windows import shorter
from pendulum_sysid.studies.proof.rivals.ground import Ground, list_terms, set_effect
from pendulum_twin.effects.effect import Effect
from pendulum_twin.signals import Floats

PARTS = 4  # errors stay where they arise: the horizon over which the diagnosis begins as well
MOST_EFFECTS = 5
MOST_STARTS = 6  # of an effect with a place or a period: evenly spread over its typical values
ITERATIONS = 8


@dataclass(frozen=True)
class Model:
    """Hold one set of effects as fitted, and its criterion."""

    effects: tuple[str, ...]
    solution: Solution
    criterion: float


def name_effects(ground: Ground) -> tuple[str, ...]:
    """Return the effects that lower the criterion, in the order in which they did."""
    start = ground.base
    best = _fitted(
        ground, start.effects, start.theta, start.starts if start.parts == PARTS else None
    )
    while len(best.effects) < len(start.effects) + MOST_EFFECTS:
        tried = [
            _with(ground, best, effect)
            for effect in list_terms(ground)
            if effect.name not in best.effects
        ]
        ahead = min(tried, key=lambda one: one.criterion)
        if not ahead.criterion < best.criterion:
            break
        best = ahead
    return (*ground.signs, *(name for name in best.effects if name not in start.effects))


def _with(ground: Ground, best: Model, effect: Effect) -> Model:
    """Return the model with one more effect, from the one of its typical values that runs best as it stands."""
    problem = ground.case.problem(shorter(ground.case.state, ground.split.train, PARTS))
    starts = _starts(ground, best.solution.theta, effect)
    theta = starts[0]
    if len(starts) > 1:
        theta = min(
            starts, key=lambda one: _log_power(solve(problem, one, (), best.solution.starts, 1))
        )
    return _fitted(ground, (*best.effects, effect.name), theta, best.solution.starts)


def _starts(ground: Ground, theta: Floats, effect: Effect) -> list[Floats]:
    sizes = [size_of(p, ground.case.scales) for p in effect.parameters]
    typical = list(itertools.product(*(p.probes for p in effect.parameters)))
    spread = np.unique(np.linspace(0, len(typical) - 1, MOST_STARTS).round().astype(int))
    found = []
    for k in spread:
        one = theta.copy()
        set_effect(one, effect, tuple(a * b for a, b in zip(typical[k], sizes, strict=True)))
        found.append(one)
    return found


def _fitted(
    ground: Ground, effects: tuple[str, ...], theta: Floats, starts: Floats | None
) -> Model:
    problem = ground.case.problem(shorter(ground.case.state, ground.split.train, PARTS))
    free = free_parameters(ground.case.twin, effects, ground.case.scales)
    solution = solve(problem, theta, free, starts, ITERATIONS)
    return Model(effects, solution, _log_power(solution) + 2 * len(free))


def _log_power(solution: Solution) -> float:
    """Return twice the negative log likelihood, up to a constant."""
    return float(np.sum(solution.counts.sum(axis=0) * np.log(solution.power)))
