"""The definition of a message type and of all types in it, as a recording carries it (ros2msg)."""

from __future__ import annotations

import re
from importlib.util import find_spec
from pathlib import Path

SEPARATOR = "=" * 80
BUILT_IN = {
    "bool", "byte", "char", "float32", "float64", "int8", "uint8", "int16", "uint16", "int32",
    "uint32", "int64", "uint64", "string", "wstring",
}  # fmt: skip
FIELD = re.compile(r"^\s*(?P<type>[A-Za-z][\w/]*)(?:<=\d+)?(?:\[[^\]]*\])?\s+\w+")


def find_definition(type_name: str) -> str:
    """Return the definition of a type such as "sensor_msgs/msg/JointState".

    Returns "" when the text of the type or of a type in it is not installed.
    """
    texts: dict[str, str] = {}
    waiting = [_shorten(type_name)]
    while waiting:
        name = waiting.pop(0)
        if name in texts:
            continue
        path = _find_file(name)
        if path is None:
            return ""
        texts[name] = path.read_text(encoding="utf-8")
        waiting += list_types(texts[name], package=name.split("/")[0])
    first, *others = texts.items()
    sections = [first[1], *(f"{SEPARATOR}\nMSG: {name}\n{text}" for name, text in others)]
    return "\n".join(section.rstrip("\n") for section in sections) + "\n"


def list_types(text: str, package: str) -> list[str]:
    """Return the types ("package/Name") of the fields, in order, without built-in types.

    text: the definition of a type of `package`.
    """
    types = []
    for line in text.splitlines():
        field = FIELD.match(line.split("#")[0])
        if field and field["type"] not in BUILT_IN:
            name = _shorten(field["type"])
            types.append(name if "/" in name else f"{package}/{name}")
    return types


def _shorten(type_name: str) -> str:
    return type_name.replace("/msg/", "/")


def _find_file(name: str) -> Path | None:
    """Return the file of a type: in `share` beside the `lib` of its Python package."""
    package, _, short = name.partition("/")
    spec = find_spec(package)
    if spec is None or spec.origin is None:
        return None
    candidates = (
        above / "share" / package / "msg" / f"{short}.msg" for above in Path(spec.origin).parents
    )
    return next((path for path in candidates if path.is_file()), None)
