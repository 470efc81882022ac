"""The nominal twin with its constants refitted, and nothing else: what a plain fit predicts."""

from __future__ import annotations

from pendulum_sysid.fitting.fit import HORIZONS, fit, fit_over_horizon
from pendulum_sysid.records import Fit
from pendulum_sysid.studies.proof.rival_models.model import TwinModel, measure_score
from pendulum_sysid.studies.proof.rivals.ground import Ground


def fit_model(ground: Ground) -> TwinModel:
    """Return the twin whose constants are refitted."""
    return TwinModel(refit_constants(ground).twin)


def refit_constants(ground: Ground) -> Fit:
    """Return the fit of the constants, over short or over long horizons.

    It begins where every rival begins, with the right signs. The fit that runs better on the
    choosing windows is taken, as for the oracle fit.
    """
    base = ground.base
    near = fit(ground.case, ground.split, base.effects, base.theta, HORIZONS[0])
    fits = (near, fit_over_horizon(ground.case, ground.split, near, HORIZONS[-1]))
    return min(fits, key=lambda candidate: _measure_fit(ground, candidate))


def _measure_fit(ground: Ground, candidate: Fit) -> float:
    return measure_score(TwinModel(candidate.twin), ground.case, ground.split.choose)
