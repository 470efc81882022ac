"""Begin laws beside dry friction: no curve over the velocity holds a joint at rest."""

from __future__ import annotations

from dataclasses import replace

from pendulum_sysid.finding.detectors.steady_friction import FRICTION_FORMS
from pendulum_sysid.records import Fit
from pendulum_twin.effects import BY_NAME
from pendulum_twin.parameter_vector import SLOTS


def keep_dry_friction(base: Fit, best: Fit) -> Fit:
    """Return a fit without names, from which laws begin, with the dry friction of the best fit.

    A force over the velocity runs as well as dry friction while the joint moves, and creeps where
    dry friction holds the joint. Such a law is kept by most windows, and the twin runs away in a
    window that begins at rest.
    """
    names = [e for e in best.effects if _is_dry(e) and e not in base.effects]
    if not names:
        return base
    theta = base.theta.copy()
    for name in names:
        theta[SLOTS[name]] = best.theta[SLOTS[name]]
    return replace(base, theta=theta, effects=(*base.effects, *names))


def _is_dry(name: str) -> bool:
    """Return whether an effect is a dry friction that holds a joint wherever it is."""
    effect = BY_NAME[name]
    return effect.form in FRICTION_FORMS and not effect.becomes
