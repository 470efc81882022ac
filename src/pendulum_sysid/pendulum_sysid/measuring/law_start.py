"""Begin laws beside dry friction, and beside what the pole shows by itself.

No curve over the velocity holds a joint at rest. What the pole shows by itself is there, whatever
the rest of the twin lacks.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

from pendulum_sysid.finding.detectors.steady_friction import FRICTION_FORMS
from pendulum_sysid.records import Fit
from pendulum_twin.effects import BY_NAME
from pendulum_twin.parameter_vector import SLOTS, get_neutral_values


def begin_laws(base: Fit, best: Fit, shown: Collection[str]) -> Fit:
    """Return a fit from which laws begin: without names, but for dry friction and what is shown.

    shown: effects of the best fit that the pole shows by itself.

    A force over the velocity runs as well as dry friction while the joint moves, and creeps where
    dry friction holds the joint. Such a law is kept by most windows, and the twin runs away in a
    window that begins at rest.
    """
    kept = [e for e in best.effects if e in shown or _is_dry(e)]
    names = [e for e in kept if e not in base.effects]
    if not names:
        return base
    theta = base.theta.copy()
    for name in names:
        theta[SLOTS[name]] = best.theta[SLOTS[name]]
    return replace(base, theta=theta, effects=(*base.effects, *names))


def leave_effects_out(best: Fit, effects: Collection[str]) -> Fit:
    """Return a fit from which laws begin without some of the effects of the best fit."""
    theta = best.theta.copy()
    for name in effects:
        theta[SLOTS[name]] = get_neutral_values(BY_NAME[name])
    kept = tuple(name for name in best.effects if name not in effects)
    return replace(best, theta=theta, effects=kept)


def _is_dry(name: str) -> bool:
    """Return whether an effect is a dry friction that holds a joint wherever it is."""
    effect = BY_NAME[name]
    return effect.form in FRICTION_FORMS and not effect.becomes
