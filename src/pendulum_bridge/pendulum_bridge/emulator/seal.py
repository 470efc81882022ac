"""The seal: the truth about an emulated rig, in a file that is opened after the diagnosis."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from pendulum_bridge.emulator.unlisted.table import BY_NAME, check_parameters
from pendulum_twin.errors import BadInputError
from pendulum_twin.files import read_json_object, write_atomically
from pendulum_twin.model import Twin
from pendulum_twin.rig import Rig, parse_rig
from pendulum_twin.schemas import SEAL


@dataclass(frozen=True)
class Concealed:
    """Hold the truth of an emulated rig.

    effects: catalogue name -> parameter name -> value (unit: see the parameter's name).
    rig: the true constants.
    unlisted: the same for physics that the catalogue does not hold (see `unlisted`).
    rest: the same for small physics that is always there and that nobody asks for (see `rest`).
    Raises BadInputError for an effect or parameter that does not exist.
    """

    effects: Mapping[str, Mapping[str, float]]
    rig: Rig
    unlisted: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    rest: Mapping[str, Mapping[str, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "effects", Twin("sealed", self.rig, self.effects).effects)
        for key in ("unlisted", "rest"):
            checked = {
                name: check_parameters(name, values) for name, values in getattr(self, key).items()
            }
            object.__setattr__(self, key, checked)


def write_seal(concealed: Concealed, path: str | Path) -> None:
    """Write the seal whole or not at all."""
    effects = {name: dict(values) for name, values in concealed.effects.items()}
    content: dict[str, object] = {
        "schema": SEAL,
        "effects": effects,
        "unlisted": _describe_all(concealed.unlisted),
        "rig": concealed.rig.to_mapping(),
    }
    if concealed.rest:
        content["rest"] = _describe_all(concealed.rest)
    write_atomically(path, json.dumps(content, indent=2) + "\n")


def _describe_all(unlisted: Mapping[str, Mapping[str, float]]) -> dict[str, object]:
    return {
        name: {
            "place": BY_NAME[name].place,
            "variables": list(BY_NAME[name].variables),
            "parameters": dict(values),
        }
        for name, values in unlisted.items()
    }


def open_seal(path: str | Path) -> Concealed:
    """Return what a seal holds; raise BadInputError when it is no seal."""
    content = read_json_object(Path(path), SEAL, "a seal")
    if not isinstance(content.get("effects"), dict):
        raise BadInputError(f"{path}: expected a seal with effects and rig, found no effects")
    try:
        unlisted, rest = (
            {str(name): entry["parameters"] for name, entry in (content.get(key) or {}).items()}
            for key in ("unlisted", "rest")
        )
        return Concealed(content["effects"], parse_rig(content.get("rig")), unlisted, rest)
    except BadInputError as error:
        raise BadInputError(f"{path}: {error}") from error
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise BadInputError(
            f"{path}: expected unlisted effects with their parameters, found others"
        ) from error
