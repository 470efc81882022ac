"""The registry of rivals that predict: every model is fitted to one recording of a rig."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from pendulum_sysid.studies.proof.rival_models import (
    gaussian_process,
    neural_state_space,
    refitted_constants,
    sparse_dynamics,
)
from pendulum_sysid.studies.proof.rival_models.model import Model
from pendulum_sysid.studies.proof.rivals import sparse_regression
from pendulum_sysid.studies.proof.rivals.ground import Ground


def _need_nothing() -> None:
    """Accept every installation."""


@dataclass(frozen=True)
class RivalModel:
    """Describe a rival that predicts.

    name: in the proof.
    sentence: what it does, for a person.
    fit_model: returns its model of the rig, fitted to a recording.
    check_installed: raises BadInputError when a package that it needs is missing.
    """

    name: str
    sentence: str
    fit_model: Callable[[Ground], Model]
    check_installed: Callable[[], None] = _need_nothing


RIVAL_MODELS: tuple[RivalModel, ...] = (
    RivalModel(
        "refitted_constants",
        "the nominal twin with its constants refitted, and nothing else",
        refitted_constants.fit_model,
    ),
    RivalModel(
        "sparse_dynamics",
        "sparse regression of the accelerations on a library of states and command (PySINDy)",
        sparse_dynamics.fit_model,
        sparse_regression.check_installed,
    ),
    RivalModel(
        "gaussian_process",
        "the refitted twin with a Gaussian process for the force and torque that it lacks",
        gaussian_process.fit_model,
        gaussian_process.check_installed,
    ),
    RivalModel(
        "neural_state_space",
        "a small network that steps the state from sample to sample, trained on free runs",
        neural_state_space.fit_model,
        neural_state_space.check_installed,
    ),
)


def find_rival_model(name: str) -> RivalModel:
    """Return the rival with this name."""
    return next(rival for rival in RIVAL_MODELS if rival.name == name)


def is_rival_model(name: str) -> bool:
    """Return whether a rival predicts; the others name effects."""
    return any(rival.name == name for rival in RIVAL_MODELS)
