"""One fit of all effects' terms at once, and a threshold on each term's t-value.

What one would do first with a catalogue at hand: let the regression sort it out (Draper and Smith,
Applied Regression Analysis (1998), chapter 15). Near-collinear terms share what is there, and each
looks insignificant or steals. Of an effect that contains another one, only what it adds is a term.
"""

from __future__ import annotations

from scipy.stats import norm

from pendulum_sysid.fitting.gauss_newton import half_widths, solve
from pendulum_sysid.fitting.parameters import Free, free_parameters, size_of
from pendulum_sysid.fitting.windows import shorter
from pendulum_sysid.studies.proof.rivals.ground import Ground, list_terms, set_effect
from pendulum_twin.effects import BY_NAME
from pendulum_twin.effects.effect import Effect, Parameter

LEVEL = 0.05  # chance of any wrong name at all, shared out among the terms (Bonferroni)
PARTS = (4, 1)  # short horizons first, as in a plain fit of the constants
HALF_WIDTH = 1.96  # standard errors in a half width


def name_effects(ground: Ground) -> tuple[str, ...]:
    """Return the effects whose size is significantly off neutral in the one fit of everything."""
    effects = list_terms(ground)
    names = (*ground.base.effects, *(effect.name for effect in effects))
    shared = {f"{e.name}.{p}" for e in effects for p in list_shared_sizes(e)}
    free = tuple(
        f
        for f in free_parameters(ground.case.twin, names, ground.case.scales)
        if f.name not in shared
    )
    theta = ground.base.theta.copy()
    for effect in effects:
        set_effect(theta, effect, tuple(_start(ground, p) for p in effect.parameters))
    for parts in PARTS:
        solution = solve(
            ground.case.problem(shorter(ground.case.state, ground.split.train, parts)), theta, free
        )
        theta = solution.theta
    halves = half_widths(solution, free, PARTS[-1])
    t_of = {
        one.name: _t(one, one.get(theta), half, effects)
        for one, half in zip(free, halves, strict=True)
    }
    least = float(norm.ppf(1 - LEVEL / (2 * len(t_of))))
    sizes = {e.name: [f"{e.name}.{p.name}" for p in e.parameters if not p.shape] for e in effects}
    named = [name for name, own in sizes.items() if any(t_of.get(one, 0.0) > least for one in own)]
    contained = {simple for name in named for simple in BY_NAME[name].simpler}
    return (*ground.signs, *(name for name in named if name not in contained))


def list_shared_sizes(effect: Effect) -> set[str]:
    """Return the sizes that an effect has in common with those that it contains."""
    simple = {p.name for name in effect.simpler for p in BY_NAME[name].parameters}
    return {p.name for p in effect.parameters if not p.shape and p.name in simple}


def _start(ground: Ground, parameter: Parameter) -> float:
    """Return neutral for a size, the middle one of its typical values for a place, a period, a limit."""
    if not parameter.shape:
        return parameter.neutral
    typical = sorted(parameter.probes)[len(parameter.probes) // 2] * size_of(
        parameter, ground.case.scales
    )
    return min(max(typical, parameter.low), parameter.high)


def _t(one: Free, value: float, half_width: float, effects: tuple[Effect, ...]) -> float:
    """Return how many standard errors a fitted parameter is off neutral; 0 for a constant of the rig."""
    neutral = next(
        (p.neutral for e in effects for p in e.parameters if f"{e.name}.{p.name}" == one.name),
        value,
    )
    return HALF_WIDTH * abs(value - neutral) / max(half_width, 1e-300)
