"""Examine one trial: the diagnosis, the oracle fit and the rivals get the same recording.

The results are kept beside the recording as `examined.json`, so that a proof that was interrupted
goes on from there.
"""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from pendulum_sysid.cleaning.clean import clean_recording
from pendulum_sysid.fitting.compare import EVERY_S, compare
from pendulum_sysid.fitting.noise_floor import measure_noise_floor
from pendulum_sysid.fitting.windows import cut_windows
from pendulum_sysid.pipeline import diagnose
from pendulum_sysid.prepare import Prepared, prepare, prepare_case
from pendulum_sysid.reading.bag import read_bag
from pendulum_sysid.records import Outcome, Recording
from pendulum_sysid.studies.proof.oracle_fit import fit_oracle
from pendulum_sysid.studies.proof.read_trial import read_trial
from pendulum_sysid.studies.proof.records import OpenedTrial
from pendulum_sysid.studies.proof.rival_models.elsewhere import score_rival_models
from pendulum_sysid.studies.proof.rival_models.registry import is_rival_model
from pendulum_sysid.studies.proof.rivals import find_rival
from pendulum_sysid.studies.proof.rivals.ground import Ground, make_ground
from pendulum_sysid.telling.output_files import format_json, write_text
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin, load_twin
from pendulum_twin.parameter_vector import make_theta

SCHEMA = "pendulum_examined/1"
FILE = "examined.json"


def examine_trial(folder: Path, rivals: Sequence[str] = ()) -> Path:
    """Do what has not been done about a trial, keep the results, and return the folder.

    rivals: names of rivals that name effects, and of rivals that predict.

    An error of the diagnosis, the oracle fit or a rival is kept as its answer and not raised.
    """
    results = read_examined(folder) or {"schema": SCHEMA, "rivals": {}}
    trial = read_trial(folder)
    if "verdict" not in results:
        results |= run_diagnosis(trial)
        results["told"] = _run_oracle(trial)
        if trial.pairs and trial.other is not None:
            results["second"] = run_second(trial.other, trial.twin)
        write_text(folder / FILE, format_json(results) + "\n")
    missing = list_missing_rivals(results, rivals)
    if missing:
        models = [name for name in missing if is_rival_model(name)]
        namers = [name for name in missing if not is_rival_model(name)]
        results["rivals"] |= _run_rivals(trial, namers)
        floor = results.get("floor_elsewhere")
        results["models"] = results.get("models", {}) | _run_models(trial, models, floor)
        write_text(folder / FILE, format_json(results) + "\n")
    return folder


def list_missing_rivals(results: dict[str, Any], rivals: Sequence[str]) -> list[str]:
    """Return the rivals that have not answered yet."""
    answered = {*results["rivals"], *results.get("models", {})}
    return [name for name in rivals if name not in answered]


def read_examined(folder: Path) -> dict[str, Any] | None:
    """Return the results that are kept about a trial; None when there are none."""
    try:
        content = json.loads((folder / FILE).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return content if isinstance(content, dict) and content.get("schema") == SCHEMA else None


def is_complete(folder: Path, rivals: Sequence[str] = ()) -> bool:
    """Return whether nothing is left to do about a trial."""
    results = read_examined(folder)
    if results is None or "verdict" not in results:
        return False
    return not list_missing_rivals(results, rivals)


def run_diagnosis(trial: OpenedTrial) -> dict[str, Any]:
    """Return the verdict, the times that it took, and the error that broke it off.

    verdict: as verdict.json; `unusable` when the recording was refused, empty after an error.
    seconds: wall time from opening the bag to the verdict, s.
    cpu_seconds: CPU time of this thread, s.
    error: empty for none.
    modelled: see `records.Judgement`.
    floor_elsewhere: the score of a perfect model on the other recording; None for none.
    """
    began, worked = time.monotonic(), time.process_time()
    verdict, error, twin = _diagnose(trial.bag, load_twin(trial.twin))
    seconds, cpu_seconds = time.monotonic() - began, time.process_time() - worked
    modelled = floor = None
    if trial.other is not None and twin is not None:
        modelled, floor = score_elsewhere(trial.other, twin.drop_recording_effects())
    return {
        "verdict": verdict,
        "seconds": seconds,
        "cpu_seconds": cpu_seconds,
        "error": error,
        "modelled": modelled,
        "floor_elsewhere": floor,
    }


def run_second(bag: Path, twin: Path) -> dict[str, Any]:
    """Return the verdict on a second recording, the error that broke it off, and a score.

    given: of the nominal twin there, over that of a perfect model.
    """
    nominal = load_twin(twin)
    verdict, error = _diagnose(bag, nominal)[:2]
    return {"verdict": verdict, "error": error, "given": score_elsewhere(bag, nominal)[0]}


def _diagnose(bag: Path, nominal: Twin) -> tuple[dict[str, Any], str, Twin | None]:
    """Return the verdict as a mapping, the error that broke it off, and the improved twin."""
    try:
        answer = diagnose([clean_recording(read_bag(bag))], nominal, _discard)
    except BadInputError as refusal:
        return {"outcome": Outcome.UNUSABLE.value, "sentence": str(refusal)}, "", None
    except Exception as crash:  # a finding about the diagnosis, not the end of the proof
        return {}, _name_error(crash), None
    return answer.to_dict(), "", answer.twin


def score_elsewhere(bag: Path, twin: Twin) -> tuple[float | None, float | None]:
    """Return a twin's score on another recording over a perfect model's, and the latter."""
    try:
        case = prepare_case([clean_recording(read_bag(bag))], twin)
        score = compare(case).score
    except BadInputError:
        return None, None
    windows = cut_windows(case.signals, case.state, EVERY_S)
    floor = measure_noise_floor(case, make_theta(case.twin), windows)
    return (None, None) if floor is None else (score / floor.score, floor.score)


def prepare_ground(trial: OpenedTrial) -> Ground:
    """Return what every rival gets."""
    prepared = _prepare(trial)
    return make_ground(prepared.case, prepared.split)


def run_rival(name: str, ground: Ground, shared_s: float) -> dict[str, Any]:
    """Return a rival's names, its seconds and its error.

    shared_s: time that all rivals share and that counts for each, s.
    """
    began = time.monotonic()
    named: list[str] = []
    error = ""
    try:
        named = list(find_rival(name).name_effects(ground))
    except Exception as crash:
        error = _name_error(crash)
    return {"named": named, "seconds": shared_s + time.monotonic() - began, "error": error}


def _run_rivals(trial: OpenedTrial, rivals: Sequence[str]) -> dict[str, Any]:
    if not rivals:
        return {}
    began = time.monotonic()
    try:
        ground = prepare_ground(trial)
    except Exception as crash:
        seconds, error = time.monotonic() - began, _name_error(crash)
        return {name: {"named": [], "seconds": seconds, "error": error} for name in rivals}
    shared_s = time.monotonic() - began
    return {name: run_rival(name, ground, shared_s) for name in rivals}


def _run_models(trial: OpenedTrial, names: Sequence[str], floor: float | None) -> dict[str, Any]:
    """Return what rivals that predict reach on the other recording; None where there is none.

    floor: the score of a perfect model there, by the improved twin; None where it is not known.
    """
    if trial.other is None:
        return {name: {"floors": None, "cpu_seconds": 0.0, "error": ""} for name in names}
    if not names:
        return {}
    try:
        return score_rival_models(prepare_ground(trial), trial.other, names, floor)
    except Exception as crash:
        error = _name_error(crash)
        return {name: {"floors": None, "cpu_seconds": 0.0, "error": error} for name in names}


def _run_oracle(trial: OpenedTrial) -> dict[str, Any]:
    """Return score and estimates of the oracle fit, or the error that broke it off."""
    try:
        prepared = _prepare(trial)
        oracle = fit_oracle(prepared.case, prepared.split, trial)
    except Exception as crash:
        return {"score": None, "estimates": {}, "error": _name_error(crash)}
    estimates = {name: asdict(estimate) for name, estimate in oracle.estimates.items()}
    return {"score": oracle.score, "estimates": estimates}


def _read(trial: OpenedTrial) -> Recording:
    return clean_recording(read_bag(trial.bag))


def _prepare(trial: OpenedTrial) -> Prepared:
    """Return the recording prepared as for a diagnosis, so that windows are the same for all."""
    return prepare([_read(trial)], load_twin(trial.twin))


def _name_error(crash: Exception) -> str:
    return f"{type(crash).__name__}: {crash}"


def _discard(line: str) -> None:
    """Take a line of progress that nobody reads."""
