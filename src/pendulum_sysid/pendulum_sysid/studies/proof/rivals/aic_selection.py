"""Forward selection on free runs: add the effect that lowers Akaike's criterion most.

Akaike, IEEE Trans. Automatic Control 19 (1974) 716, with Gaussian errors of unknown variance in
each channel. Every candidate is fitted in full at every step; nothing is kept for choosing,
nothing pruned.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from pendulum_sysid.fitting.gauss_newton import Solution, solve
from pendulum_sysid.fitting.parameters import compute_size, list_free_parameters
from pendulum_sysid.fitting.windows import shorten_windows
from pendulum_sysid.studies.proof.rivals.ground import Ground, list_terms, set_effect
from pendulum_twin.arrays import Floats
from pendulum_twin.effects.effect import Effect

PIECES = 4  # of a window: errors stay where they arise, as where the diagnosis begins
MOST_EFFECTS = 5
MOST_START_VALUES = 6  # of a place or a period, evenly spread over its typical values
MOST_ITERATIONS = 8


@dataclass(frozen=True)
class Model:
    """Hold one set of effects as fitted.

    effects: names.
    solution: the fit.
    criterion: Akaike's, up to a constant that all sets share; lower is better.
    """

    effects: tuple[str, ...]
    solution: Solution
    criterion: float


def name_effects(ground: Ground) -> tuple[str, ...]:
    """Return the effects that lower the criterion, in the order of their selection."""
    base = ground.base
    best = _fit_model(
        ground, base.effects, base.theta, base.start_states if base.pieces == PIECES else None
    )
    while len(best.effects) < len(base.effects) + MOST_EFFECTS:
        candidates = [
            _add_effect(ground, best, effect)
            for effect in list_terms(ground)
            if effect.name not in best.effects
        ]
        ahead = min(candidates, key=lambda model: model.criterion)
        if not ahead.criterion < best.criterion:
            break
        best = ahead
    return (*ground.signs, *(name for name in best.effects if name not in base.effects))


def _add_effect(ground: Ground, best: Model, effect: Effect) -> Model:
    """Return the model with another effect, begun at the typical values that run best."""
    problem = ground.case.problem(shorten_windows(ground.case.state, ground.split.train, PIECES))
    candidates = _list_start_values(ground, best.solution.theta, effect)
    theta = candidates[0]
    if len(candidates) > 1:
        theta = min(
            candidates,
            key=lambda start: _compute_log_power(
                solve(problem, start, (), best.solution.start_states, 1)
            ),
        )
    return _fit_model(ground, (*best.effects, effect.name), theta, best.solution.start_states)


def _list_start_values(ground: Ground, theta: Floats, effect: Effect) -> list[Floats]:
    """Return parameter vectors (SIZE,) with the effect at its typical values."""
    sizes = [compute_size(p, ground.case.scales) for p in effect.parameters]
    typical = list(itertools.product(*(p.probes for p in effect.parameters)))
    spread = np.unique(np.linspace(0, len(typical) - 1, MOST_START_VALUES).round().astype(int))
    candidates = []
    for k in spread:
        candidate = theta.copy()
        values = tuple(a * b for a, b in zip(typical[k], sizes, strict=True))
        set_effect(candidate, effect, values)
        candidates.append(candidate)
    return candidates


def _fit_model(
    ground: Ground, effects: tuple[str, ...], theta: Floats, start_states: Floats | None
) -> Model:
    problem = ground.case.problem(shorten_windows(ground.case.state, ground.split.train, PIECES))
    free = list_free_parameters(ground.case.twin, effects, ground.case.scales)
    solution = solve(problem, theta, free, start_states, MOST_ITERATIONS)
    return Model(effects, solution, _compute_log_power(solution) + 2 * len(free))


def _compute_log_power(solution: Solution) -> float:
    """Return twice the negative log likelihood, up to a constant."""
    return float(np.sum(solution.counts.sum(axis=0) * np.log(solution.power)))
