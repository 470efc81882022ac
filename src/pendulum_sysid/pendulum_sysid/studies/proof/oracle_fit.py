"""Fit a recording as one who was told what is concealed: the best that a diagnosis could have come to."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pendulum_sysid.fitting.case import Case, make_case
from pendulum_sysid.fitting.fit import HORIZONS, fit
from pendulum_sysid.fitting.window_runs import run_windows
from pendulum_sysid.records import Estimate, Recording, Split
from pendulum_sysid.studies.proof.records import OpenedTrial
from pendulum_twin.effects import BY_NAME
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import make_theta
from pendulum_twin.rig import parse_rig


@dataclass(frozen=True)
class OracleFit:
    """Hold what the fit that was told came to: its score on held-out windows, and its estimates of effects and rig."""

    score: float
    estimates: dict[str, Estimate]


def fit_oracle(recording: Recording, sealed: OpenedTrial, parts: Split) -> OracleFit:
    """Return the fit of exactly the concealed effects from the true values, on the diagnosis's own windows.

    Of a fit over short and one over long horizons, the one that runs better on the choosing
    windows. A stale start is no
    part of it: those samples count nowhere. Physics that the catalogue does not have is not told.
    """
    truth = make_true_twin(sealed)
    case = make_case(recording, Twin(truth.name, truth.rig))
    fits = [
        fit(case, parts, tuple(truth.effects), make_theta(truth), horizon) for horizon in HORIZONS
    ]
    best = min(fits, key=lambda one: _score(case, one.twin, parts, "choose"))
    return OracleFit(_score(case, best.twin, parts, "held_out"), best.estimates)


def make_true_twin(sealed: OpenedTrial) -> Twin:
    """Return the twin that the seal describes, as far as the catalogue goes."""
    known = {
        n: v for n, v in sealed.effects.items() if BY_NAME[n].searched or not BY_NAME[n].parameters
    }
    return Twin(sealed.name, parse_rig(dict(sealed.rig)), known)


def _score(case: Case, twin: Twin, parts: Split, part: str) -> float:
    score = run_windows(replace(case, twin=twin), getattr(parts, part)).score
    return score if np.isfinite(score) else float("inf")
