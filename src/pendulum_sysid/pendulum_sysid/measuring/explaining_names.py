"""Find the effects that explain most of what measured laws leave without them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pendulum_sysid.finding.judge import compute_lead, is_most_explained, is_surely_there
from pendulum_sysid.measuring.further_law import fit_longer
from pendulum_sysid.measuring.measure import Measured
from pendulum_sysid.measuring.names_beside_laws import is_of_kind, leave_out_names, list_sized
from pendulum_sysid.measuring.penalised_fit import LawFit
from pendulum_sysid.measuring.ranking import rank_curves
from pendulum_sysid.records import Fit


def list_explaining(measured: Measured, fit: Fit, doubted: Sequence[str]) -> dict[str, LawFit]:
    """Return the doubted effects that explain most of what is left without them, beside the laws.

    By the effect's name: the fit with the same laws without the effect. The laws make the effect's
    size sure, and no law of the effect's kind does as well in its place.

    fit: with laws, and with intervals of its own.
    doubted: effects that are no names without laws.
    """
    sized = [
        name
        for name in list_sized(measured, doubted)
        if is_surely_there(fit, name, measured.case.scales)
    ]
    return {
        name: less
        for name, less in leave_out_names(measured, sized).items()
        if is_most_explained(measured.law_fit.fit, less.fit)
        and _is_ahead_of_law(measured, name, less)
    }


def _is_ahead_of_law(measured: Measured, name: str, without: LawFit) -> bool:
    """Return whether an effect is really ahead of a law of its kind in its place.

    The law may have any shape: a drag at a place stands for any drag along the rail. An effect
    without such a law, as a stretching belt, has no law to be ahead of.

    without: the fit with the same laws without the effect.
    """
    case, split = measured.case, measured.split
    own = [c for c in rank_curves(case, split, without) if is_of_kind(c.curve, name)]
    if not own:
        return True
    try:
        with_law = fit_longer(case, split, without, own[0])
    except np.linalg.LinAlgError:
        return False
    return compute_lead(measured.law_fit.fit, with_law.fit).is_real
