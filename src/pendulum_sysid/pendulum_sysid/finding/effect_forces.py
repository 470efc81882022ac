"""Compute what each effect of a twin gives along a recording, in both equations at once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pendulum_sysid.finding.localisation.balance import (
    Balance,
    compute_sharp_accelerations,
    make_balances,
)
from pendulum_sysid.finding.localisation.shape_check import (
    compute_own_force,
    project_out_constants,
    take_out,
)
from pendulum_sysid.finding.localisation.thinning import thin_out
from pendulum_sysid.fitting.case import Case
from pendulum_twin.arrays import Floats


class EffectForces:
    """Compare the forces of effects; what the rig's constants could give as well is left out.

    case: the recording.
    theta: (SIZE,) of the twin through whose sensors the motion is seen.
    """

    def __init__(self, case: Case, theta: Floats) -> None:
        self._case = thin_out(case)
        self._sharp = compute_sharp_accelerations(self._case)
        self._balances: tuple[Balance, ...] = make_balances(self._case, theta)

    def compute(self, theta: Floats, names: Sequence[str]) -> Floats:
        """Return the forces of effects, (effects, rows), in units of the equations' size.

        theta: (SIZE,) of the twin.
        """
        return np.array([self.compute_share(theta, take_out(theta, name)) for name in names])

    def compute_share(self, theta: Floats, less: Floats) -> Floats:
        """Return what a twin gives beyond another, (rows,); theta, less: (SIZE,) of both."""
        parts = [
            project_out_constants(
                balance, compute_own_force(self._case, theta, less, self._sharp, balance.equation)
            )
            for balance in self._balances
        ]
        return np.concatenate(parts) if parts else np.empty(0)
