"""Weigh the sets of effects that a search tried, by how well each predicts windows left out.

Pseudo-Bayesian model averaging with the Bayesian bootstrap (pseudo-BMA+; Yao, Vehtari, Simpson and
Gelman, Bayesian Analysis 13 (2018) 917): a set's weight is the share of draws of block weights in
which its cross-validated errors are the lowest.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.finding.judge import average_over_blocks, compute_log_errors, count_parameters
from pendulum_sysid.records import Fit
from pendulum_twin.effects import BY_NAME

SEED = 0  # of the draws


@dataclass(frozen=True)
class WeighedSet:
    """Hold a set of effects and how much it is believed.

    effects: names.
    weight: 0 to 1; all sets that were tried have 1 together.
    """

    effects: tuple[str, ...]
    weight: float


def weigh_sets(fits: Iterable[Fit], best: Fit) -> tuple[WeighedSet, ...]:
    """Return the sets of fits over the horizon of the best fit, the most believed first.

    best: the fit that the search ended at; its typical window sets the scale of the errors.

    A parameter costs what a lead has to gain at least.
    """
    kept: dict[frozenset[str], Fit] = {}
    for fit in (*fits, best):
        same = fit.pieces == best.pieces and fit.window_squares.shape == best.window_squares.shape
        if same and np.isfinite(fit.choose):
            other = kept.get(frozenset(fit.effects))
            if other is None or fit.choose < other.choose:
                kept[frozenset(fit.effects)] = fit
    candidates = list(kept.values())
    if not candidates:
        return ()
    cost = np.log(decisions.LEAD_MISFIT_RATIO)
    losses = np.array(
        [average_over_blocks(compute_log_errors(fit, best).mean(axis=1)) for fit in candidates]
    )
    losses += cost * np.array([[count_parameters(fit)] for fit in candidates])
    draws = np.random.default_rng(SEED).dirichlet(np.ones(losses.shape[1]), decisions.SET_DRAWS)
    wins = np.bincount(np.argmin(losses @ draws.T, axis=0), minlength=len(candidates))
    order = np.argsort(-wins, kind="stable")
    return tuple(
        WeighedSet(candidates[k].effects, float(wins[k]) / decisions.SET_DRAWS) for k in order
    )


def weigh_effect(
    sets: Sequence[WeighedSet], effect: str, inseparable_from: Collection[str] = ()
) -> float:
    """Return how much an effect is believed: the weight of all sets that hold it.

    A set holds it, too, with an effect that contains it, and with what it cannot be told from.

    inseparable_from: names of effects that do as well in its place.
    """
    stand_ins = {effect, *inseparable_from}
    return float(
        sum(
            s.weight
            for s in sets
            if any(e in stand_ins or effect in BY_NAME[e].simpler for e in s.effects)
        )
    )
