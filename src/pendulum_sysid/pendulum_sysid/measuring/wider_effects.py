"""Ask beside measured laws for an effect that contains a name, in the place of the name.

Where much has no name, a search stays with the simpler of two effects: what the wider effect adds
has to be large beside all that is left (`judge.Lead`). Laws take what is left away, and the
simpler effect shows what it lacks. Effects that contain no name are not asked for: beside laws any
effect leads a little (docs/tried.md).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.finding.growth import order_proposals
from pendulum_sysid.finding.judge import is_needed
from pendulum_sysid.finding.propose import Proposal, list_candidates, propose
from pendulum_sysid.measuring.measure import Measured
from pendulum_sysid.measuring.penalised_fit import LawFit, fit_laws
from pendulum_twin.arrays import Floats
from pendulum_twin.parameter_vector import SLOTS


def find_wider_effects(measured: Measured, names: Sequence[str]) -> dict[str, Floats]:
    """Return effects that contain names and are surely needed in their places, beside the laws.

    Each with its parameters there.

    names: the effects that are asked.
    """
    wider: dict[str, Floats] = {}
    if measured.is_at_noise:
        return wider
    law_fit = measured.law_fit
    for name in names:
        other = _find_wider_effect(measured, law_fit, name)
        if other is not None:
            (effect,) = set(other.fit.effects) - set(law_fit.fit.effects)
            wider[effect] = other.fit.theta[SLOTS[effect]]
            law_fit = other
    return wider


def _find_wider_effect(measured: Measured, law_fit: LawFit, name: str) -> LawFit | None:
    """Return the fit with the effect that is surely needed in a name's place; None for none."""
    case, fit = measured.case, law_fit.fit
    if name not in fit.effects or fit.choose <= decisions.MISFIT_AT_NOISE:
        return None
    candidates = [e for e in list_candidates(case, fit.effects) if name in e.simpler]
    if not candidates:
        return None
    for proposal in order_proposals(propose(case, measured.split, fit, candidates)):
        other = _fit_in_place(measured, law_fit, proposal)
        if is_needed(other.fit, fit, proposal.effect):
            return other
    return None


def _fit_in_place(measured: Measured, law_fit: LawFit, proposal: Proposal) -> LawFit:
    """Return the best fit with a proposed effect beside the same laws."""
    case, split = measured.case, measured.split
    begun = [
        fit_laws(
            case,
            split,
            replace(law_fit.fit, theta=theta, effects=proposal.effects),
            law_fit.curves,
            law_fit.priors,
            law_fit.inflation,
        )
        for theta in np.atleast_2d(proposal.theta)
    ]
    return min(begun, key=lambda fit: fit.fit.choose)
