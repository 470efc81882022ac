"""The seal: the truth about an emulated rig, in a file that is opened after the diagnosis."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from pendulum_bridge.emulator.unlisted import BY_NAME, check_parameters
from pendulum_twin.errors import BadInputError
from pendulum_twin.files import read_json_object, write_atomically
from pendulum_twin.model import Twin
from pendulum_twin.rig import Rig, parse_rig

SCHEMA = "pendulum_seal/1"


@dataclass(frozen=True)
class Concealed:
    """Hold the truth of an emulated rig.

    effects: catalogue name -> parameter name -> value (unit: see the parameter's name).
    rig: the true constants.
    unlisted: the same for physics that the catalogue does not hold (see `unlisted`).
    Raises BadInputError for an effect or parameter that does not exist.
    """

    effects: Mapping[str, Mapping[str, float]]
    rig: Rig
    unlisted: Mapping[str, Mapping[str, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "effects", Twin("sealed", self.rig, self.effects).effects)
        object.__setattr__(
            self,
            "unlisted",
            {name: check_parameters(name, values) for name, values in self.unlisted.items()},
        )


def write_seal(concealed: Concealed, path: str | Path) -> None:
    """Write the seal whole or not at all."""
    effects = {name: dict(values) for name, values in concealed.effects.items()}
    unlisted = {
        name: _describe_unlisted(name, values) for name, values in concealed.unlisted.items()
    }
    content = {
        "schema": SCHEMA,
        "effects": effects,
        "unlisted": unlisted,
        "rig": concealed.rig.to_mapping(),
    }
    write_atomically(path, json.dumps(content, indent=2) + "\n")


def _describe_unlisted(name: str, values: Mapping[str, float]) -> dict[str, object]:
    known = BY_NAME[name]
    return {"place": known.place, "variables": list(known.variables), "parameters": dict(values)}


def open_seal(path: str | Path) -> Concealed:
    """Return what a seal holds; raise BadInputError when it is no seal."""
    content = read_json_object(Path(path), SCHEMA, "a seal")
    if not isinstance(content.get("effects"), dict):
        raise BadInputError(f"{path}: expected a seal with effects and rig, found no effects")
    try:
        unlisted = {
            str(name): entry["parameters"]
            for name, entry in (content.get("unlisted") or {}).items()
        }
        return Concealed(content["effects"], parse_rig(content.get("rig")), unlisted)
    except BadInputError as error:
        raise BadInputError(f"{path}: {error}") from error
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise BadInputError(
            f"{path}: expected unlisted effects with their parameters, found others"
        ) from error
