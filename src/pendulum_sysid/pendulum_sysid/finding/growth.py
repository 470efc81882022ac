"""Grow a set of effects one by one, every step judged on windows that no fit has seen.

Forward selection (Miller, Subset Selection in Regression (2002), chapter 3).
"""

from __future__ import annotations

from collections.abc import Sequence

from pendulum_sysid import decisions
from pendulum_sysid.finding.journal import Search
from pendulum_sysid.finding.judge import choose_simplest
from pendulum_sysid.finding.need import needs_effect
from pendulum_sysid.finding.propose import Proposal, propose
from pendulum_sysid.records import Fit
from pendulum_twin.effects import BY_NAME


def grow_set(search: Search, base: Fit) -> Fit:
    """Return the base with effects added one by one, as long as a step is really ahead."""
    best = base
    while len(best.effects) < len(base.effects) + decisions.MOST_EFFECTS_ADDED:
        steps = find_steps(search, best)
        if not steps:
            break
        best = steps[0]
    return best


def find_steps(search: Search, best: Fit) -> list[Fit]:
    """Return the fits with one effect more that are really ahead, the fit to keep first."""
    search.journal.report(
        f"misfit {best.choose:.2f} with {', '.join(best.effects) or 'no effects'}: "
        "asking what is missing"
    )
    proposals = propose(search.case, search.split, best)[: decisions.CANDIDATES_REFITTED]
    fits: list[Fit] = []
    good: list[Fit] = []
    for proposal in order_proposals(proposals):
        if any(step.effects[-1] in list_contained(proposal, proposals) for step in good):
            continue
        fits.append(search.fit_effects(proposal.effects, best, proposal.theta))
        if needs_effect(search, fits[-1], best, proposal.effect):
            good.append(fits[-1])
    kept = choose_simplest(good) if good else None
    for candidate in fits:
        better = "no better than the one kept" if candidate in good else "not needed"
        search.journal.note(candidate, "kept" if candidate is kept else better)
    return sorted(good, key=lambda candidate: (candidate is not kept, candidate.choose))


def order_proposals(proposals: Sequence[Proposal]) -> list[Proposal]:
    """Return the proposals that promise enough, those that contain others of them last."""
    enough = [p for p in proposals if p.gain >= decisions.PROPOSAL_LEAST_NATS]
    return sorted(enough, key=lambda proposal: bool(list_contained(proposal, enough)))


def list_contained(proposal: Proposal, proposals: Sequence[Proposal]) -> list[str]:
    """Return the proposed effects that a proposal contains and promises no more than.

    Where such an effect is a step ahead, the proposal waits: it is asked again, as an effect in
    the place of the simpler effect, from there.
    """
    simpler = BY_NAME[proposal.effect].simpler
    least = decisions.PROPOSAL_LEAST_NATS
    return [p.effect for p in proposals if p.effect in simpler and proposal.gain < p.gain + least]
