"""A twin: the rig's constants and the effects it is believed to have. YAML in and out; unknown keys are refused."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import yaml

from pendulum_twin.effects import BY_NAME
from pendulum_twin.errors import BadInputError
from pendulum_twin.files import write_atomically
from pendulum_twin.rig import Rig, check_number, describe_unknown_key, parse_rig

SCHEMA = "pendulum_twin/1"


@dataclass(frozen=True)
class Twin:
    """Hold one rig as it is believed to be.

    effects: catalogue name -> parameter name -> value (SI units, in the parameter's name); an
    effect that is there is on. Raises BadInputError for an effect or parameter that the catalogue
    does not have, or a value out of its range.
    """

    name: str
    rig: Rig
    effects: Mapping[str, Mapping[str, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(
            self,
            "effects",
            {name: _check_effect(name, values) for name, values in self.effects.items()},
        )

    def drop_recording_effects(self) -> Twin:
        """Return the twin without the effects that belong to one recording of the rig."""
        kept = {name: v for name, v in self.effects.items() if not BY_NAME[name].of_recording}
        return Twin(self.name, self.rig, kept)

    def to_mapping(self) -> dict:
        """Return the twin as the twin file holds it."""
        effects = {name: dict(values) for name, values in self.effects.items()}
        return {
            "schema": SCHEMA,
            "name": self.name,
            "rig": self.rig.to_mapping(),
            "effects": effects,
        }


def _check_effect(name: str, values: object) -> dict[str, float]:
    if name not in BY_NAME:
        raise BadInputError(f"effects: unknown effect {name}; known are {', '.join(BY_NAME)}")
    parameters = {p.name: p for p in BY_NAME[name].parameters}
    if not isinstance(values, Mapping):
        raise BadInputError(
            f"effects: {name}: expected a mapping of parameters to numbers, found {values!r}"
        )
    for key in values:
        if key not in parameters:
            raise BadInputError(
                describe_unknown_key(f"effects: {name}", str(key), tuple(parameters))
            )
    missing = [key for key in parameters if key not in values]
    if missing:
        raise BadInputError(f"effects: {name}: expected {missing[0]}, found it missing")
    return {
        key: check_number(f"effects: {name}: {key}", values[key], p.low, p.high)
        for key, p in parameters.items()
    }


def parse_twin(mapping: object) -> Twin:
    """Return the twin that a twin file holds; raise BadInputError naming the key that is wrong."""
    if not isinstance(mapping, Mapping):
        raise BadInputError(
            f"expected a mapping with schema, name, rig and effects, found {type(mapping).__name__}"
        )
    for key in mapping:
        if key not in ("schema", "name", "rig", "effects"):
            raise BadInputError(
                describe_unknown_key("twin file", str(key), ("schema", "name", "rig", "effects"))
            )
    if mapping.get("schema") != SCHEMA:
        raise BadInputError(f"expected schema: {SCHEMA}, found {mapping.get('schema')!r}")
    effects = mapping.get("effects") or {}
    if not isinstance(effects, Mapping):
        raise BadInputError(
            f"effects: expected a mapping of catalogue names, found {type(effects).__name__}"
        )
    return Twin(
        str(mapping.get("name", "rig")),
        parse_rig(mapping.get("rig")),
        {str(name): values if values is not None else {} for name, values in effects.items()},
    )


def load_twin(path: str | Path) -> Twin:
    """Return the twin in a YAML file; raise BadInputError when it cannot be read or holds something wrong."""
    try:
        text = Path(path).read_text(encoding="utf-8")
        mapping = yaml.safe_load(text)
    except (OSError, UnicodeDecodeError) as error:
        raise BadInputError(
            f"{path}: expected a twin file, but it cannot be read: {error}"
        ) from error
    except (
        yaml.YAMLError,
        ValueError,
        RecursionError,
    ) as error:  # a date that is none, a thousand brackets
        raise BadInputError(
            f"{path}: expected YAML, found {str(error).splitlines()[0]}"
        ) from error
    try:
        return parse_twin(mapping)
    except BadInputError as error:
        raise BadInputError(f"{path}: {error}") from error


def save_twin(twin: Twin, path: str | Path) -> None:
    """Write the twin file whole or not at all."""
    write_atomically(path, yaml.safe_dump(twin.to_mapping(), sort_keys=False))
