"""Take out of a set the effects that it does not need (backward elimination)."""

from __future__ import annotations

from collections.abc import Collection

from pendulum_sysid.finding.journal import Search
from pendulum_sysid.finding.need import needs_effect
from pendulum_sysid.finding.propose import hand_over
from pendulum_sysid.records import Fit
from pendulum_twin.arrays import Floats
from pendulum_twin.effects import BY_NAME
from pendulum_twin.parameter_vector import SLOTS, get_neutral_values


def prune_set(
    search: Search, kept: Collection[str], best: Fit, expected: Collection[str] = ()
) -> Fit:
    """Return the fit without the effects that it does not need: left out, or made simpler.

    Without an effect, others may be needed more or less, so the question is asked again until
    every effect stays.

    kept: effects that are not asked about.
    expected: effects that other evidence names; they need only be ahead, by however little.
    """
    for name in [e for e in best.effects if e not in kept and BY_NAME[e].parameters]:
        others = tuple(e for e in best.effects if e != name)
        simpler = [e for e in BY_NAME[name].simpler if e not in others]
        for effects in (others, *((*others, e) for e in simpler)):
            smaller = search.fit_effects(effects, best, exchange_effect(best, name, effects))
            needed = needs_effect(search, best, smaller, name, name in expected)
            verdict = f"worse without {name}" if needed else f"as good without {name}"
            search.journal.note(smaller, verdict)
            if not needed:
                return prune_set(search, kept, smaller, expected)
    return best


def fit_without_effect(search: Search, best: Fit, name: str) -> Fit:
    """Return the fit without an effect, all others fitted again."""
    others = tuple(effect for effect in best.effects if effect != name)
    return search.fit_effects(others, best, exchange_effect(best, name, others))


def exchange_effect(best: Fit, name: str, effects: Collection[str]) -> Floats:
    """Return theta (SIZE,) of a fit without an effect, to start a fit of other effects from.

    An effect that is new among them starts from the parameters of the same names.
    """
    theta = best.theta.copy()
    for new in effects:
        if new not in best.effects:
            hand_over(theta, BY_NAME[name], BY_NAME[new])
    theta[SLOTS[name]] = get_neutral_values(BY_NAME[name])
    return theta
