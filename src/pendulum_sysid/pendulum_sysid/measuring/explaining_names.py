"""Find the effects that explain most of what measured laws leave without them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.finding.effect_forces import EffectForces
from pendulum_sysid.finding.judge import compute_lead, explains_most, is_surely_there
from pendulum_sysid.measuring.further_law import fit_longer
from pendulum_sysid.measuring.measure import Measured
from pendulum_sysid.measuring.names_beside_laws import is_of_kind, leave_out_names, list_sized
from pendulum_sysid.measuring.penalised_fit import LawFit
from pendulum_sysid.measuring.ranking import step_to_curves
from pendulum_sysid.records import Fit


def list_explaining(measured: Measured, fit: Fit, doubted: Sequence[str]) -> dict[str, LawFit]:
    """Return the doubted effects that explain most of what is left without them, beside the laws.

    By the effect's name: the fit with the same laws without the effect. The laws make the effect's
    size sure, and a law that could have any shape has the effect's shape in its place.

    fit: with laws, and with intervals of its own.
    doubted: effects that are no names without laws, and the same in every environment beside them.
    """
    sized = [
        name
        for name in list_sized(measured, doubted)
        if is_surely_there(fit, name, measured.case.scales)
    ]
    return {
        name: less
        for name, less in leave_out_names(measured, sized).items()
        if explains_most(measured.law_fit.fit, less.fit) and _has_own_shape(measured, name, less)
    }


def _has_own_shape(measured: Measured, name: str, without: LawFit) -> bool:
    """Return whether a law of the effect's kind in its place does worse, or has its shape.

    A drag at a place stands for any drag along the rail. The law's force may differ from the
    effect's by STEADY_SHARE of it, by amplitude.

    without: the fit with the same laws without the effect.
    """
    case, split = measured.case, measured.split
    own = [c for c, _ in step_to_curves(case, split, without) if is_of_kind(c.curve, name)]
    if not own:
        return True
    try:
        free = fit_longer(case, split, without, own[0])
    except np.linalg.LinAlgError:
        return True
    with_effect, with_law = measured.law_fit.fit, free.fit
    if compute_lead(with_effect, with_law).is_real:
        return True
    forces = EffectForces(case, with_effect.theta)
    less = with_law.theta.copy()
    free.curves[-1].put(less, np.zeros(len(free.curves[-1].knots)))
    of_effect = forces.compute(with_effect.theta, [name])[0]
    off = forces.compute_share(with_law.theta, less) - of_effect
    return bool(off @ off <= decisions.STEADY_SHARE**2 * of_effect @ of_effect)
