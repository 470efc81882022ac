"""Hold a twin: the rig's constants and its believed effects; read and write twin files."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from reprlib import repr as shown
from typing import Any

from pendulum_twin.effects import BY_NAME
from pendulum_twin.effects.effect import Effect
from pendulum_twin.errors import BadInputError
from pendulum_twin.files import read_yaml_as, write_atomically
from pendulum_twin.laws import BY_NAME as LAW_KINDS
from pendulum_twin.laws.kind import LawKind
from pendulum_twin.laws.law import MOST_LAWS, Law, check_law
from pendulum_twin.pole_body import POLE_COM_KEY, check_pole_body
from pendulum_twin.rig import Rig, check_number, describe_unknown_key, parse_rig
from pendulum_twin.strict_yaml import format_yaml
from pendulum_twin.suggest import hint_at_names

SCHEMA = "pendulum_twin/1"
KEYS = ("schema", "name", "rig", "effects", "measured_laws")
LARGEST_SPREAD = 1e6  # in the unit of the constant


@dataclass(frozen=True)
class Twin:
    """Hold a rig as it is believed to be.

    name: of the rig.
    rig: its constants.
    effects: catalogue name -> parameter name -> value, in the unit of the parameter's name; an
        effect that is listed is on.
    measured_laws: name of the kind -> curve, for physics without a name; MOST_LAWS at most.
    spreads: constant of the rig -> standard deviation of what is believed of it, in its unit; 0
        for a constant that is known. A constant that is not listed is a guess.

    Raises BadInputError for an effect, parameter or law that does not exist, for a value out of
    its range, and for too many laws.
    """

    name: str
    rig: Rig
    effects: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    measured_laws: Mapping[str, Law] = field(default_factory=dict)
    spreads: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(
            self,
            "effects",
            {name: _check_effect(name, values) for name, values in self.effects.items()},
        )
        if len(self.measured_laws) > MOST_LAWS:
            raise BadInputError(
                f"measured_laws: expected at most {MOST_LAWS}, found {len(self.measured_laws)}"
            )
        laws = {name: _check_law(name, law) for name, law in self.measured_laws.items()}
        object.__setattr__(self, "measured_laws", laws)
        object.__setattr__(
            self,
            "spreads",
            {key: _check_spread(self.rig, key, sd) for key, sd in self.spreads.items()},
        )

    def hold(self, keys: str | Iterable[str]) -> Twin:
        """Return the twin with constants that are known: no fit changes them.

        keys: of the rig; a text is a single key.

        Raises BadInputError for a key that the rig does not have.
        """
        names = [keys] if isinstance(keys, str) else keys
        return replace(self, spreads={**self.spreads, **dict.fromkeys(names, 0.0)})

    def drop_recording_effects(self) -> Twin:
        """Return the twin without what belongs to one recording, as that leaves the rig."""
        return self._drop(lambda kind: kind.of_recording)

    def drop_timed_effects(self) -> Twin:
        """Return the twin without what counts a recording's time, as that leaves the rig."""
        return self._drop(lambda kind: kind.timed)

    def _drop(self, is_over: Callable[[Effect | LawKind], bool]) -> Twin:
        rig = self.rig
        for name, values in self.effects.items():
            effect = BY_NAME[name]
            if is_over(effect) and effect.rig_after is not None:
                rig = effect.rig_after(rig, *(values[p.name] for p in effect.parameters))
        effects = {name: v for name, v in self.effects.items() if not is_over(BY_NAME[name])}
        laws = {n: v for n, v in self.measured_laws.items() if not is_over(LAW_KINDS[n])}
        return replace(self, rig=rig, effects=effects, measured_laws=laws)

    def to_mapping(self) -> dict[str, Any]:
        """Return the twin as the twin file holds it."""
        effects = {name: dict(values) for name, values in self.effects.items()}
        mapping = {
            "schema": SCHEMA,
            "name": self.name,
            "rig": {
                key: {"value": value, "sd": self.spreads[key]} if key in self.spreads else value
                for key, value in self.rig.to_mapping().items()
            },
            "effects": effects,
        }
        if self.measured_laws:
            mapping["measured_laws"] = {
                name: {
                    LAW_KINDS[name].knots_key: list(law.knots),
                    LAW_KINDS[name].values_key: list(law.values),
                }
                for name, law in self.measured_laws.items()
            }
        return mapping


def _check_spread(rig: Rig, key: str, spread: object) -> float:
    """Return a constant's standard deviation; raise BadInputError."""
    if key not in rig.to_mapping():
        raise BadInputError(describe_unknown_key("rig", key, tuple(rig.to_mapping())))
    return check_number(f"rig: {key}: sd", spread, 0.0, LARGEST_SPREAD)


def _split_spreads(block: object) -> tuple[object, dict[str, object]]:
    """Return the rig block with plain numbers, and the standard deviations beside them."""
    if not isinstance(block, Mapping):
        return block, {}
    values, spreads = dict(block), {}
    for key, entry in block.items():
        if isinstance(entry, Mapping):
            if set(entry) != {"value", "sd"}:
                raise BadInputError(
                    f"rig: {key}: expected a number, or value and sd, found {shown(entry)}"
                )
            values[key], spreads[str(key)] = entry["value"], entry["sd"]
    return values, spreads


def _check_effect(name: str, values: object) -> dict[str, float]:
    """Return an effect's values in the order of its parameters; raise BadInputError."""
    if name not in BY_NAME:
        raise BadInputError(f"effects: unknown effect {name}; {hint_at_names(name, BY_NAME)}")
    parameters = {p.name: p for p in BY_NAME[name].parameters}
    if not isinstance(values, Mapping):
        raise BadInputError(
            f"effects: {name}: expected a mapping of parameters to numbers, found {shown(values)}"
        )
    for key in values:
        if key not in parameters:
            raise BadInputError(
                describe_unknown_key(f"effects: {name}", str(key), tuple(parameters))
            )
    missing = [key for key, p in parameters.items() if key not in values and not p.optional]
    if missing:
        raise BadInputError(f"effects: {name}: expected {missing[0]}, found it missing")
    return {
        key: check_number(f"effects: {name}: {key}", values.get(key, p.neutral), p.low, p.high)
        for key, p in parameters.items()
    }


def _check_law(name: str, law: object) -> Law:
    """Return a law after all checks; it may be a twin file's mapping."""
    if isinstance(law, Law) and name in LAW_KINDS:
        kind = LAW_KINDS[name]
        law = {kind.knots_key: law.knots, kind.values_key: law.values}
    return check_law(name, law)


def parse_twin(mapping: object) -> Twin:
    """Return the twin of a twin file's mapping; raise BadInputError naming a wrong key."""
    if not isinstance(mapping, Mapping):
        raise BadInputError(
            f"expected a mapping with schema, name, rig and effects, found {shown(mapping)}"
        )
    for key in mapping:
        if key not in KEYS:
            raise BadInputError(describe_unknown_key("twin file", str(key), KEYS))
    if mapping.get("schema") != SCHEMA:
        raise BadInputError(f"expected schema: {SCHEMA}, found {shown(mapping.get('schema'))}")
    effects = mapping.get("effects") or {}
    if not isinstance(effects, Mapping):
        raise BadInputError(
            f"effects: expected a mapping of catalogue names, found {shown(effects)}"
        )
    laws = mapping.get("measured_laws") or {}
    if not isinstance(laws, Mapping):
        raise BadInputError(f"measured_laws: expected a mapping of laws, found {shown(laws)}")
    block, spreads = _split_spreads(mapping.get("rig"))
    rig = parse_rig(block)
    check_pole_body(rig)
    return Twin(
        str(mapping.get("name", "rig")),
        rig,
        {str(name): values if values is not None else {} for name, values in effects.items()},
        {str(name): law for name, law in laws.items()},
        _spread_com_distance(rig, block, spreads),
    )


def _spread_com_distance(rig: Rig, block: object, spreads: Mapping[str, Any]) -> dict[str, Any]:
    """Return the spreads, that of the pole's own distance as one of the common distance."""
    kept = {key: sd for key, sd in spreads.items() if key != POLE_COM_KEY}
    if POLE_COM_KEY in spreads and isinstance(block, Mapping):
        sd = check_number(f"rig: {POLE_COM_KEY}: sd", spreads[POLE_COM_KEY], 0.0, LARGEST_SPREAD)
        kept["com_distance_m"] = sd * (rig.pole_mass_kg or 0.0) / rig.total_mass_kg
    return kept


def load_twin(path: str | Path) -> Twin:
    """Return the twin in a YAML file; raise BadInputError, with path and line, for none."""
    return read_yaml_as(parse_twin, path, "a twin file")


def save_twin(twin: Twin, path: str | Path) -> None:
    """Write the twin file whole or not at all."""
    style = {"default_flow_style": None, "width": 95} if twin.measured_laws else {}
    write_atomically(path, format_yaml(twin.to_mapping(), **style))
