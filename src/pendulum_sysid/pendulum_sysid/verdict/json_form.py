"""The JSON form of a verdict: one function each way, both driven by the types of the record."""

from __future__ import annotations

import math
import types
from collections.abc import Mapping
from dataclasses import MISSING, fields, is_dataclass
from enum import Enum
from functools import cache
from typing import Any, Literal, TypeAliasType, Union, get_args, get_origin, get_type_hints

from pendulum_sysid.verdict.record import Verdict
from pendulum_twin.errors import BadInputError
from pendulum_twin.schemas import VERDICT

NOT_IN_FILE = {
    "command", "twin", "localisation", "trials", "overlays", "next_plan", "origin", "drawings",
    "events_s",
}  # fmt: skip
LEFT_OUT_IF_NONE = {  # a joint that was not recorded, a motion that does not come again
    "held_out_cart_mm", "held_out_pole_rad", "held_out_cart_fit", "held_out_pole_fit", "floors",
    "repeats", "wandering",
}  # fmt: skip


def encode_verdict(verdict: Verdict) -> dict[str, Any]:
    """Return what verdict.json holds, in JSON's types; null stands for NaN and infinity."""
    return {"schema": VERDICT, **_encode(verdict)}


def decode_verdict(content: Mapping[str, Any]) -> Verdict:
    """Return the verdict in the content of verdict.json; other keys than the record's are ignored.

    A null where a number is expected becomes NaN. Raises BadInputError naming the key that is
    missing or of another type.
    """
    if not isinstance(content, Mapping) or content.get("schema") != VERDICT:
        raise BadInputError(f"expected a verdict with schema {VERDICT}, found another content")
    verdict: Verdict = _decode(Verdict, content, "verdict")
    return verdict


def _encode(value: Any) -> Any:
    if is_dataclass(value):
        items = {f.name: getattr(value, f.name) for f in fields(value)}
        return {
            name: _encode(item)
            for name, item in items.items()
            if name not in NOT_IN_FILE and (item is not None or name not in LEFT_OUT_IF_NONE)
        }
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, Mapping):
        return {name: _encode(item) for name, item in value.items()}
    if isinstance(value, tuple):
        return [_encode(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def _decode(kind: Any, value: Any, key: str) -> Any:
    """Return the JSON value as an object of the annotated type; `key` names it in an error."""
    if isinstance(kind, TypeAliasType):
        return _decode(kind.__value__, value, key)
    origin, arguments = get_origin(kind), get_args(kind)
    if origin in (Union, types.UnionType):  # the record holds X | None only
        return None if value is None else _decode(arguments[0], value, key)
    if is_dataclass(kind):
        return _decode_record(kind, value, key)
    if origin is tuple and isinstance(value, list):
        kinds = [arguments[0]] * len(value) if arguments[-1] is ... else arguments
        if len(kinds) == len(value):
            pairs = zip(kinds, value, strict=True)
            return tuple(_decode(k, item, f"{key}[{n}]") for n, (k, item) in enumerate(pairs))
    if origin is dict and isinstance(value, Mapping):
        return {str(n): _decode(arguments[1], item, f"{key}.{n}") for n, item in value.items()}
    if isinstance(kind, type) and issubclass(kind, Enum) and value in {e.value for e in kind}:
        return kind(value)
    if origin is Literal and value in arguments:
        return value
    if kind is float and (value is None or _is_number(value)):
        return math.nan if value is None else float(value)
    if kind in (str, bool, int) and type(value) is kind:
        return value
    raise BadInputError(f"{key}: expected {getattr(kind, '__name__', kind)}, found {value!r}")


def _decode_record(kind: Any, value: Any, key: str) -> Any:
    if not isinstance(value, Mapping):
        raise BadInputError(f"{key}: expected a mapping, found {value!r}")
    hints = _read_hints(kind)
    arguments = {}
    for f in fields(kind):
        if f.name in NOT_IN_FILE:
            continue
        if f.name in value:
            arguments[f.name] = _decode(hints[f.name], value[f.name], f"{key}.{f.name}")
        elif f.default is MISSING and f.default_factory is MISSING:
            raise BadInputError(f"{key}: expected {f.name}, found it missing")
    return kind(**arguments)


@cache
def _read_hints(kind: type) -> dict[str, Any]:
    return get_type_hints(kind)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
