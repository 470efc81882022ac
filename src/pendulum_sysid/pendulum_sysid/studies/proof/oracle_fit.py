"""The oracle fit: the concealed effects are known, and their parameters are fitted.

It is what a diagnosis could reach at best. (In statistics an oracle estimator is given the true
set of terms.)
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pendulum_sysid.fitting.case import Case, change_twin
from pendulum_sysid.fitting.fit import HORIZONS, fit, fit_over_horizon
from pendulum_sysid.fitting.window_runs import run_windows
from pendulum_sysid.records import Estimate, Split, Windows
from pendulum_sysid.studies.proof.records import OpenedTrial
from pendulum_twin.effects import BY_NAME
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import make_theta
from pendulum_twin.rig import parse_rig


@dataclass(frozen=True)
class OracleFit:
    """Hold what the oracle fit came to.

    score: on the held-out windows; 1 is the sensors' noise.
    estimates: "key" of the rig or "effect.parameter" -> estimate.
    """

    score: float
    estimates: dict[str, Estimate]


def fit_oracle(case: Case, split: Split, trial: OpenedTrial) -> OracleFit:
    """Return the fit of exactly the concealed effects, begun at their true values.

    Of the fits over short and over long horizons, the result is the one that runs best on the
    choosing windows. Stale samples count nowhere, and physics that the catalogue does not have
    cannot be fitted.

    case, split: the recording as the diagnosis has it.
    """
    truth = make_true_twin(trial)
    case = change_twin(case, Twin(truth.name, truth.rig))
    theta = make_theta(truth)
    near = fit(case, split, tuple(truth.effects), theta, HORIZONS[0])
    fits = (near, fit_over_horizon(case, split, near, HORIZONS[-1]))
    best = min(fits, key=lambda candidate: _compute_score(case, candidate.twin, split.choose))
    return OracleFit(_compute_score(case, best.twin, split.held_out), best.estimates)


def make_true_twin(trial: OpenedTrial) -> Twin:
    """Return the twin that the seal describes, as far as the catalogue goes."""
    effects = {
        name: values
        for name, values in trial.seal.effects.items()
        if BY_NAME[name].searched or not BY_NAME[name].parameters
    }
    return Twin(trial.name, parse_rig(dict(trial.seal.rig)), effects)


def _compute_score(case: Case, twin: Twin, windows: Windows) -> float:
    score = run_windows(replace(case, twin=twin), windows).score
    return score if np.isfinite(score) else float("inf")
