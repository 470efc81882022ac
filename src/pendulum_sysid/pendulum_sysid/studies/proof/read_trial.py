"""Open a trial: what was recorded, how, and what was concealed in it."""

from __future__ import annotations

from pathlib import Path

from pendulum_sysid.studies.proof.records import OpenedTrial, UnlistedEffect
from pendulum_twin.errors import BadInputError
from pendulum_twin.json_files import read_json_object
from pendulum_twin.rig import parse_rig

TRIAL, SEAL = "pendulum_trial/1", "pendulum_seal/1"


def read_trial(folder: Path) -> OpenedTrial:
    """Return a trial's folder opened; raise BadInputError, naming the file, when it is none."""
    trial, seal = (
        read_json_object(folder / "trial.json", TRIAL, "a trial"),
        read_json_object(folder / "seal.json", SEAL, "a seal"),
    )
    try:
        return OpenedTrial(
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
            rig=parse_rig(seal["rig"]).to_mapping(),
            unlisted=tuple(
                UnlistedEffect(str(name), str(one["place"]), tuple(one["variables"]))
                for name, one in (seal.get("unlisted") or {}).items()
            ),
        )
    except (KeyError, TypeError, ValueError, AttributeError, BadInputError) as error:
        raise BadInputError(
            f"{folder}: expected a trial with its seal, found it incomplete ({error})"
        ) from error
