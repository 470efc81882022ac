"""Find effects that stand in an effect's place in other sets of effects that are believed.

Two sets may part the same force otherwise: with a delay, or with a lag beside something small.
Neither set is believed enough for its name, but both hold one force (jointness of regressors:
Doppelhofer and Weeks, J. Appl. Econometrics 24 (2009) 209). So both names are told, and that the
recordings cannot tell which of them it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from pendulum_sysid import decisions
from pendulum_sysid.finding.effect_forces import EffectForces
from pendulum_sysid.finding.weights import WeighedSet
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.records import Fit


@dataclass(frozen=True)
class StandIn:
    """Hold an effect that gives nearly the force of another effect in a set without that effect.

    effect: its name.
    within: the set.
    """

    effect: str
    within: WeighedSet


def list_stand_ins(
    case: Case, best: Fit, sets: Sequence[WeighedSet], effect: str
) -> tuple[StandIn, ...]:
    """Return the effects that give nearly the force of an effect in sets without it.

    best: the fit that holds the effect.
    sets: the sets that were tried.

    The difference of both forces has less than CANCELLED_SHARE of the power of the effect's force.
    An effect may stand in within one set, and be quite another force in another set.
    """
    forces = EffectForces(case, best.theta)
    (own,) = forces.compute(best.theta, [effect])
    stand_ins = []
    for other in sets:
        new = [name for name in other.effects if name not in best.effects]
        if effect in other.effects or other.theta is None or not new or not other.weight:
            continue
        for name, force in zip(new, forces.compute(other.theta, new), strict=True):
            left = own - force
            if left @ left < decisions.CANCELLED_SHARE * own @ own:
                stand_ins.append(StandIn(name, other))
    return tuple(stand_ins)
