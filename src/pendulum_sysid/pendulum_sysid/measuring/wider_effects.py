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

from pendulum_sysid.finding.growth import order_proposals
from pendulum_sysid.finding.judge import is_needed
from pendulum_sysid.finding.propose import Proposal, list_candidates, propose
from pendulum_sysid.measuring.measure import Measured
from pendulum_sysid.measuring.penalised_fit import LawFit, fit_laws
from pendulum_sysid.records import Fit


def find_wider_effects(measured: Measured, names: Sequence[str]) -> Fit | None:
    """Return the fit with laws that has wider effects in the place of names.

    None where no wider effect is surely needed beside the laws.

    names: the effects that are asked.
    """
    law_fit, replaced = measured.law_fit, False
    for name in names:
        case, fit = measured.case, law_fit.fit
        if measured.is_at_noise or name not in fit.effects:
            continue
        wider = [e for e in list_candidates(case, fit.effects) if name in e.simpler]
        proposals = propose(case, measured.split, fit, wider) if wider else []
        for proposal in order_proposals(proposals):
            other = _fit_in_place(measured, law_fit, proposal)
            if is_needed(other.fit, fit, proposal.effect):
                law_fit, replaced = other, True
                break
    return law_fit.fit if replaced else None


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
