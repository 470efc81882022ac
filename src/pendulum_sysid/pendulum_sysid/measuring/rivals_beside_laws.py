"""Ask beside measured laws what could stand in the place of a name.

Before laws are measured, what has no name hides which of two effects is there. The laws take what
has no name, and a rival may be outdone then.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from pendulum_sysid.finding.judge import is_outdone
from pendulum_sysid.finding.naming import Named
from pendulum_sysid.finding.propose import list_replaced, put_effect
from pendulum_sysid.measuring.measure import Measured
from pendulum_sysid.measuring.penalised_fit import fit_laws
from pendulum_sysid.records import Fit
from pendulum_twin.effects import BY_NAME
from pendulum_twin.parameter_vector import SLOTS, get_neutral_values


def ask_rivals_again(measured: Measured, named: Iterable[Named]) -> tuple[Named, ...]:
    """Return the names without the rivals that are outdone beside the laws.

    named: effects of the fit with laws. A rival that has no fit of its own stays.
    """
    return tuple(_ask_rivals_of(measured, effect) for effect in named)


def _ask_rivals_of(measured: Measured, effect: Named) -> Named:
    best, out = measured.law_fit.fit, set[str]()
    for fit in effect.rivals:
        new = set(fit.effects).intersection(effect.inseparable_from).difference(best.effects)
        out |= {
            rival for rival in new if is_outdone(_put_rival(measured, effect, rival, fit), best)
        }
    return replace(
        effect,
        inseparable_from=tuple(name for name in effect.inseparable_from if name not in out),
        rivals=tuple(fit for fit in effect.rivals if not out.intersection(fit.effects)),
    )


def _put_rival(measured: Measured, effect: Named, rival: str, fit: Fit) -> Fit:
    """Return the fit with the same laws, and a rival in the place of an effect.

    fit: without laws, that holds the rival.
    """
    law_fit = measured.law_fit
    others = tuple(name for name in law_fit.fit.effects if name != effect.effect)
    theta = law_fit.fit.theta.copy()
    for name in (effect.effect, *list_replaced(BY_NAME[rival], others)):
        theta[SLOTS[name]] = get_neutral_values(BY_NAME[name])
    theta[SLOTS[rival]] = fit.theta[SLOTS[rival]]
    start = replace(law_fit.fit, theta=theta, effects=put_effect(BY_NAME[rival], others))
    curves, priors = law_fit.curves, law_fit.priors
    return fit_laws(measured.case, measured.split, start, curves, priors, law_fit.inflation).fit
