"""Grow a set of effects one by one, every step judged on windows that no fit has seen.

Forward selection (Miller, Subset Selection in Regression (2002), chapter 3).
"""

from __future__ import annotations

from collections.abc import Sequence

from pendulum_sysid import decisions
from pendulum_sysid.finding.journal import Search
from pendulum_sysid.finding.judge import choose_simplest, compute_lead
from pendulum_sysid.finding.need import needs_effect
from pendulum_sysid.finding.propose import Proposal, propose
from pendulum_sysid.records import Fit
from pendulum_twin.effects import BY_NAME


def grow_set(search: Search, base: Fit, known: Fit | None = None) -> Fit:
    """Return the base with effects added one by one, as long as a step is really ahead.

    known: the fit at which another search ended; None for none. A set that holds all effects of
        that fit, and is no better, grows no further.
    """
    best = base
    while len(best.effects) < len(base.effects) + decisions.MOST_EFFECTS_ADDED:
        if known is not None and _comes_back(best, known):
            break
        steps = find_steps(search, best)
        if not steps:
            break
        best = steps[0]
    return best


def _comes_back(fit: Fit, known: Fit) -> bool:
    return set(fit.effects) >= set(known.effects) and not compute_lead(fit, known).is_real


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


def list_simplest(steps: Sequence[Fit], taken: Sequence[Fit] = ()) -> list[Fit]:
    """Return the steps that lead elsewhere: to the simplest effects that were not tried yet.

    Left out are steps whose new effect contains the new effect of another step: a search goes from
    an effect to another that contains it, and back, by itself.

    taken: steps with which a search has begun already. Their new effects, and the effects that
        these contain, are left out, too.
    """
    names = {step.effects[-1] for step in steps}
    gone = {
        name for step in taken for name in (step.effects[-1], *BY_NAME[step.effects[-1]].simpler)
    }
    return [
        step
        for step in steps
        if step.effects[-1] not in gone and not names & set(BY_NAME[step.effects[-1]].simpler)
    ]
