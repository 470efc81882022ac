"""Open a trial: what was recorded, how, and what was concealed in it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from pendulum_sysid.prove.records import Sealed, Unlisted
from pendulum_twin.errors import BadInputError
from pendulum_twin.rig import rig_from_mapping

TRIAL, SEAL = "pendulum_trial/1", "pendulum_seal/1"


def read_sealed(folder: Path) -> Sealed:
    """Return a trial's folder opened; raise BadInputError, naming the file, when it is none."""
    trial, seal = _mapping(folder / "trial.json", TRIAL), _mapping(folder / "seal.json", SEAL)
    try:
        return Sealed(
            name=folder.name,
            bag=folder / "bag",
            twin=folder / "twin.yaml",
            kind=str(trial["kind"]),
            seed=int(trial["seed"]),
            pole_counts=int(trial["pole_counts"]),
            seconds=float(trial["seconds"]),
            closed_loop=bool(trial["closed_loop"]),
            size_factor=float(trial["size_factor"]),
            effects={str(name): dict(values) for name, values in seal["effects"].items()},
            rig=rig_from_mapping(seal["rig"]).to_mapping(),
            unlisted=tuple(
                Unlisted(str(name), str(one["place"]), tuple(one["variables"]))
                for name, one in (seal.get("unlisted") or {}).items()
            ),
        )
    except (KeyError, TypeError, ValueError, AttributeError, BadInputError) as error:
        raise BadInputError(f"{folder}: expected a trial with its seal, found it incomplete ({error})") from error


def _mapping(path: Path, schema: str) -> dict[str, Any]:
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise BadInputError(f"{path}: expected a file of schema {schema}, but it cannot be read: {error}") from error
    if not isinstance(content, dict) or content.get("schema") != schema:
        raise BadInputError(f"{path}: expected a file of schema {schema}, found another")
    return content
