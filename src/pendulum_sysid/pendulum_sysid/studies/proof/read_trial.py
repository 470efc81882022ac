"""Read a trial's folder, and open its seal."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pendulum_sysid.studies.proof.records import OpenedTrial, Seal, UnlistedEffect
from pendulum_twin.errors import BadInputError
from pendulum_twin.files import read_json_object
from pendulum_twin.rig import parse_rig
from pendulum_twin.schemas import SEAL, TRIAL

MALFORMED = (KeyError, TypeError, ValueError, AttributeError, BadInputError)


def read_trial(folder: Path) -> OpenedTrial:
    """Return the trial in a folder; raise BadInputError, naming the file, when there is none."""
    content = read_json_object(folder / "trial.json", TRIAL, "a trial")
    seal = read_seal(folder / "seal.json")
    try:
        return OpenedTrial(
            name=folder.name,
            bag=folder / "bag",
            twin=folder / "twin.yaml",
            kind=str(content["kind"]),
            seed=int(content["seed"]),
            pole_counts=int(content["pole_counts"]),
            seconds=float(content["seconds"]),
            closed_loop=bool(content["closed_loop"]),
            size_factor=float(content["size_factor"]),
            seal=seal,
            other=folder / "other" if (folder / "other").is_dir() else None,
            pairs=bool(content.get("pairs", False)),
            relay=bool(content.get("relay", False)),
        )
    except MALFORMED as error:
        raise BadInputError(
            f"{folder}: expected a trial with its seal, found it incomplete ({error})"
        ) from error


def read_seal(path: Path) -> Seal:
    """Return what a seal's file says was concealed; raise BadInputError when it is no seal."""
    content = read_json_object(path, SEAL, "a seal")
    try:
        return Seal(
            effects={str(name): dict(values) for name, values in content["effects"].items()},
            rig=parse_rig(content["rig"]).to_mapping(),
            unlisted=_read_unlisted(content.get("unlisted") or {}),
            rest=_read_unlisted(content.get("rest") or {}),
        )
    except MALFORMED as error:
        raise BadInputError(
            f"{path}: expected a seal with effects and rig, found it incomplete ({error})"
        ) from error


def _read_unlisted(content: dict[str, Any]) -> tuple[UnlistedEffect, ...]:
    return tuple(
        UnlistedEffect(str(name), str(entry["place"]), tuple(entry["variables"]))
        for name, entry in content.items()
    )
