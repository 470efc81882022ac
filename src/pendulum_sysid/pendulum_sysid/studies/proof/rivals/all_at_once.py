"""One fit of all effects' terms at once, and a threshold on each term's t-value.

The first thing to try with a catalogue at hand (Draper and Smith, Applied Regression Analysis
(1998), chapter 15). Near-collinear terms share an effect, and each looks insignificant or takes
the share of another. Of an effect that contains a simpler effect, only what it adds is a term.
"""

from __future__ import annotations

from scipy.stats import norm

from pendulum_sysid.fitting.gauss_newton import complete_system, compute_half_widths, solve
from pendulum_sysid.fitting.parameters import Free, compute_size, list_free_parameters
from pendulum_sysid.fitting.windows import shorten_windows
from pendulum_sysid.studies.proof.rivals.ground import Ground, list_terms, set_effect
from pendulum_twin.effects import BY_NAME
from pendulum_twin.effects.effect import Effect, Parameter

FALSE_NAME_CHANCE = 0.05  # of any wrong name; divided among the terms (Bonferroni)
HORIZONS = (4, 1)  # pieces of a window: short horizons first, as in a plain fit of the constants
HALF_WIDTH_STANDARD_ERRORS = 1.96


def name_effects(ground: Ground) -> tuple[str, ...]:
    """Return the effects whose size differs significantly from neutral in the fit of all."""
    effects = list_terms(ground)
    fitted = (*ground.base.effects, *(effect.name for effect in effects))
    shared = {f"{e.name}.{p}" for e in effects for p in list_shared_sizes(e)}
    free = tuple(
        f
        for f in list_free_parameters(ground.case.twin, fitted, ground.case.scales)
        if f.name not in shared
    )
    theta = ground.base.theta.copy()
    for effect in effects:
        set_effect(theta, effect, tuple(_choose_start(ground, p) for p in effect.parameters))
    for pieces in HORIZONS:
        windows = shorten_windows(ground.case.state, ground.split.learn, pieces)
        problem = ground.case.problem(windows)
        solution = complete_system(problem, solve(problem, theta, free), free)
        theta = solution.theta
    halves = compute_half_widths(solution, free, HORIZONS[-1])
    t_of = {
        parameter.name: _compute_t(parameter, parameter.get(theta), half, effects)
        for parameter, half in zip(free, halves, strict=True)
    }
    least = float(norm.ppf(1 - FALSE_NAME_CHANCE / (2 * len(t_of))))
    sizes = {e.name: [f"{e.name}.{p.name}" for p in e.sizes] for e in effects}
    named = [
        effect
        for effect, names in sizes.items()
        if any(t_of.get(name, 0.0) > least for name in names)
    ]
    contained = {simple for name in named for simple in BY_NAME[name].simpler}
    return (*ground.signs, *(name for name in named if name not in contained))


def list_shared_sizes(effect: Effect) -> set[str]:
    """Return the sizes that an effect has in common with those that it contains."""
    simple = {p.name for name in effect.simpler for p in BY_NAME[name].parameters}
    return {p.name for p in effect.sizes if p.name in simple}


def _choose_start(ground: Ground, parameter: Parameter) -> float:
    """Return neutral for a size, the middle of the typical values for a place or a period."""
    if not parameter.shape:
        return parameter.neutral
    typical = sorted(parameter.probes)[len(parameter.probes) // 2] * compute_size(
        parameter, ground.case.scales
    )
    return min(max(typical, parameter.low), parameter.high)


def _compute_t(
    parameter: Free, value: float, half_width: float, effects: tuple[Effect, ...]
) -> float:
    """Return the distance from neutral in standard errors; 0 for a constant of the rig."""
    neutral = next(
        (
            p.neutral
            for effect in effects
            for p in effect.parameters
            if f"{effect.name}.{p.name}" == parameter.name
        ),
        value,
    )
    return HALF_WIDTH_STANDARD_ERRORS * abs(value - neutral) / max(half_width, 1e-300)
