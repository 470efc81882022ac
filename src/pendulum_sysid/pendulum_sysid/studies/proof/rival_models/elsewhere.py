"""Score rivals' models on another recording of the same rig, in floors, as our own twin."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pendulum_sysid.cleaning.clean import clean_recording
from pendulum_sysid.errors import UnusableRecording
from pendulum_sysid.fitting.blas_threads import use_one_blas_thread
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.compare import EVERY_S
from pendulum_sysid.fitting.noise_floor import measure_noise_floor
from pendulum_sysid.fitting.windows import cut_windows
from pendulum_sysid.prepare import prepare_case
from pendulum_sysid.reading.bag import read_bag
from pendulum_sysid.records import Windows
from pendulum_sysid.studies.proof.rival_models.model import measure_score
from pendulum_sysid.studies.proof.rival_models.refitted_constants import refit_constants
from pendulum_sysid.studies.proof.rival_models.registry import find_rival_model
from pendulum_sysid.studies.proof.rivals.ground import Ground
from pendulum_twin.parameter_vector import make_theta

MOST_FLOORS = 1e6  # of runs that diverge


def score_rival_models(
    ground: Ground, other: Path, names: Sequence[str], floor: float | None = None
) -> dict[str, Any]:
    """Return what each rival's model reaches on another recording of the rig.

    ground: of the first recording, which alone the models are fitted to.
    other: the bag of the other recording.
    floor: the score of a perfect model there; None for that of the twin with its constants
        refitted. Where the improved twin's is given, rivals and twin are in the same unit.

    Returns by name: floors, the score over a perfect model's there; cpu_seconds of fit and runs;
    error, empty for none. An error of a rival is its answer. Raises UnusableRecording when there
    is no floor to score by.
    """
    twin = refit_constants(ground).twin
    case = prepare_case([clean_recording(read_bag(other))], twin)
    windows = cut_windows(case.signals, case.state, EVERY_S)
    if floor is None:
        floor = _measure_floor(case, windows)
    with use_one_blas_thread():
        return {name: score_rival_model(name, ground, case, windows, floor) for name in names}


def score_rival_model(
    name: str, ground: Ground, case: Case, windows: Windows, floor: float
) -> dict[str, Any]:
    """Return an entry of `score_rival_models`.

    case, windows: the other recording and where it is run.
    floor: the score of a perfect model there.
    """
    began = time.process_time()
    floors, error = None, ""
    try:
        model = find_rival_model(name).fit_model(ground)
        floors = min(measure_score(model, case, windows) / floor, MOST_FLOORS)
    except Exception as crash:  # a finding about the rival, not the end of the proof
        error = f"{type(crash).__name__}: {crash}"
    return {"floors": floors, "cpu_seconds": time.process_time() - began, "error": error}


def _measure_floor(case: Case, windows: Windows) -> float:
    floor = measure_noise_floor(case, make_theta(case.twin), windows)
    if floor is None:
        raise UnusableRecording(
            "expected windows of the other recording in which the noise floor can be measured, "
            "found none: record longer"
        )
    return floor.score
