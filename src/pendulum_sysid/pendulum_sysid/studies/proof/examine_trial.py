"""Examine one trial: diagnose it blindly, then let the fit that is told the truth and the rivals have the same recording.

What was found is kept beside the recording as `examined.json`, so that a proof that was
interrupted goes on from there.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from pendulum_sysid.cleaning.clean import clean_recording
from pendulum_sysid.cleaning.moving_joints import leave_out_still_cart
from pendulum_sysid.cleaning.stale_start import leave_out_stale_start
from pendulum_sysid.fitting.case import make_case
from pendulum_sysid.fitting.split import split
from pendulum_sysid.pipeline import diagnose
from pendulum_sysid.reading.bag import read_bag
from pendulum_sysid.records import Outcome, Recording
from pendulum_sysid.studies.proof.oracle_fit import fit_oracle
from pendulum_sysid.studies.proof.read_trial import read_trial
from pendulum_sysid.studies.proof.records import OpenedTrial
from pendulum_sysid.studies.proof.rivals import find_rival
from pendulum_sysid.studies.proof.rivals.ground import Ground, make_ground
from pendulum_sysid.telling.output_files import json_text, write_text
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import load_twin

SCHEMA = "pendulum_examined/1"
FILE = "examined.json"


def examine_trial(folder: Path, rivals: Sequence[str] = ()) -> Path:
    """Do what has not been done yet about a trial, keep it beside the recording, and return the folder.

    Nothing that a recording does to the diagnosis or a rival escapes from here: it is kept as
    their answer.
    """
    found = read_examined(folder) or {"schema": SCHEMA, "rivals": {}}
    sealed = read_trial(folder)
    if "verdict" not in found:
        found |= _diagnosed(sealed)
        found["told"] = _guarded(lambda: _told(sealed))
        write_text(folder / FILE, json_text(found) + "\n")
    left = [name for name in rivals if name not in found["rivals"]]
    if left:
        found["rivals"] |= _asked(sealed, left)
        write_text(folder / FILE, json_text(found) + "\n")
    return folder


def read_examined(folder: Path) -> dict[str, Any] | None:
    """Return what is known about a trial, None when nothing is."""
    try:
        content = json.loads((folder / FILE).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return content if isinstance(content, dict) and content.get("schema") == SCHEMA else None


def is_complete(folder: Path, rivals: Sequence[str] = ()) -> bool:
    """Return whether nothing is left to do about a trial."""
    found = read_examined(folder)
    return found is not None and "verdict" in found and set(rivals) <= set(found["rivals"])


def _diagnosed(sealed: OpenedTrial) -> dict[str, Any]:
    """Return verdict, the seconds from opening the bag to the verdict, and what broke it off, if anything did.

    cpu_seconds, too: what this one thread worked, whatever else the machine did meanwhile.
    """
    began, worked = time.monotonic(), time.process_time()
    try:
        verdict, error = diagnose([_read(sealed)], load_twin(sealed.twin), _silent).verdict, ""
    except BadInputError as refusal:
        verdict, error = {"outcome": Outcome.UNUSABLE.value, "sentence": str(refusal)}, ""
    except (
        Exception
    ) as crash:  # one trial that breaks is a finding about the diagnosis, not the end of the proof
        verdict, error = {}, f"{type(crash).__name__}: {crash}"
    seconds, cpu_seconds = time.monotonic() - began, time.process_time() - worked
    return {"verdict": verdict, "seconds": seconds, "cpu_seconds": cpu_seconds, "error": error}


def _told(sealed: OpenedTrial) -> dict[str, Any]:
    recording = _prepared(sealed)
    parts = split(recording.signals, make_case(recording, load_twin(sealed.twin)).state)
    found = fit_oracle(recording, sealed, parts)
    return {
        "score": found.score,
        "estimates": {name: asdict(one) for name, one in found.estimates.items()},
    }


def _asked(sealed: OpenedTrial, rivals: Sequence[str]) -> dict[str, Any]:
    """Return each rival's names and seconds; what all of them begin with counts as time of each."""
    began = time.monotonic()
    try:
        ground = _ground(sealed)
    except Exception as crash:
        return {name: _broken(crash, time.monotonic() - began) for name in rivals}
    shared = time.monotonic() - began
    return {name: _answer(name, ground, shared) for name in rivals}


def _answer(name: str, ground: Ground, shared_s: float) -> dict[str, Any]:
    began = time.monotonic()
    try:
        named = find_rival(name).answer(ground)
        return {"named": list(named), "seconds": shared_s + time.monotonic() - began, "error": ""}
    except Exception as crash:
        return _broken(crash, shared_s + time.monotonic() - began)


def _broken(crash: Exception, seconds: float) -> dict[str, Any]:
    return {"named": [], "seconds": seconds, "error": f"{type(crash).__name__}: {crash}"}


def _ground(sealed: OpenedTrial) -> Ground:
    recording = _prepared(sealed)
    case = make_case(recording, load_twin(sealed.twin))
    return make_ground(case, split(case.signals, case.state))


def _guarded(work: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    try:
        return work()
    except Exception as crash:
        return {"score": None, "estimates": {}, "error": f"{type(crash).__name__}: {crash}"}


def _read(sealed: OpenedTrial) -> Recording:
    return clean_recording(read_bag(sealed.bag))


def _prepared(sealed: OpenedTrial) -> Recording:
    """Return the recording as a diagnosis cuts it, so that windows are the same for all."""
    return leave_out_still_cart(leave_out_stale_start(_read(sealed)))


def _silent(line: str) -> None:
    pass
