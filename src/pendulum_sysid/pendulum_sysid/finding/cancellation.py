"""Find effects that others of the same fit nearly cancel: large sizes that together give little.

A small error of a shape that the catalogue does not have is built from several effects whose
sizes are far larger than the error: an offset and a scale of the angle that take each other back,
and a wave that bends what is left. Such sizes say nothing of the rig (collinearity: Belsley, Kuh
and Welsch, Regression Diagnostics (1980), chapter 3).
"""

from __future__ import annotations

from itertools import combinations

from pendulum_sysid import decisions
from pendulum_sysid.finding.effect_forces import EffectForces
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.records import Fit
from pendulum_twin.arrays import Floats
from pendulum_twin.effects import BY_NAME


def list_cancelled(case: Case, fit: Fit) -> frozenset[str]:
    """Return the effects of a fit, beyond the given twin's, that others of them nearly cancel.

    An effect is nearly cancelled where some of the others, together with it, give a force with
    less than CANCELLED_SHARE of the power of its own force.
    """
    names = [
        name for name in fit.effects if name not in case.twin.effects and BY_NAME[name].parameters
    ]
    if len(names) < 2:
        return frozenset()
    forces = EffectForces(case, fit.theta).compute(fit.theta, names)
    return frozenset(
        name
        for k, name in enumerate(names)
        if _compute_least_power(forces, k) < decisions.CANCELLED_SHARE * forces[k] @ forces[k]
    )


def _compute_least_power(forces: Floats, k: int) -> float:
    """Return the least power of an effect's force together with those of any others."""
    others = [j for j in range(len(forces)) if j != k]
    sums = (
        forces[k] + forces[list(some)].sum(axis=0)
        for count in range(1, len(others) + 1)
        for some in combinations(others, count)
    )
    return min(float(total @ total) for total in sums)
