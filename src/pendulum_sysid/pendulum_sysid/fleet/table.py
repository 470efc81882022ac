"""The table of a fleet: which rigs there are, their twins, and which recordings are theirs."""

from __future__ import annotations

from dataclasses import dataclass, fields
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

from pendulum_sysid.errors import FileError, WrongUse
from pendulum_sysid.reading.columns import Columns, check_columns
from pendulum_twin.errors import BadInputError
from pendulum_twin.files import compute_digest, read_yaml
from pendulum_twin.model import load_twin

SCHEMA = "pendulum_fleet/1"
KEYS = {"twin", "recordings", "columns"}


@dataclass(frozen=True)
class RigEntry:
    """Hold one rig of the table.

    name: of the rig.
    twin: file of the twin to start from.
    twin_digest: "sha256:..." of that file.
    pattern: of the ends of addresses; a star stands for any characters, slashes too.
    columns: of its CSV files; None when it has none.
    """

    name: str
    twin: Path
    twin_digest: str
    pattern: str
    columns: Columns | None


def read_table(path: Path) -> tuple[RigEntry, ...]:
    """Return the rigs of a table.

    Raises FileError naming the rig and key when the table, or a twin that it names, is not as
    expected.
    """
    content = read_yaml(path, "a table of twins")
    rigs = content.get("rigs") if isinstance(content, dict) else None
    if not isinstance(rigs, dict) or content.get("schema") != SCHEMA or not rigs:
        raise FileError(
            f"{path}: expected a table with `schema: {SCHEMA}` and `rigs:`, found otherwise: see "
            "docs/fleet.md"
        )
    return tuple(_read_entry(path, str(name), entry) for name, entry in rigs.items())


def find_rig(rigs: tuple[RigEntry, ...], path: str) -> RigEntry | None:
    """Return the first rig whose pattern fits the end of an address; None for none."""
    return next((rig for rig in rigs if fnmatch(path, f"*/{rig.pattern}")), None)


def _read_entry(path: Path, name: str, entry: Any) -> RigEntry:
    if not isinstance(entry, dict) or "twin" not in entry or set(entry) - KEYS:
        raise FileError(
            f"{path}: expected twin and, if need be, recordings and columns for rig {name}, "
            f"found {entry!r}"
        )
    twin = path.parent / str(entry["twin"])
    try:
        load_twin(twin)
    except BadInputError as error:
        raise FileError(f"{path}: the twin of rig {name}: {error}") from error
    columns = entry.get("columns")
    return RigEntry(
        name=name,
        twin=twin,
        twin_digest=compute_digest([twin]),
        pattern=str(entry.get("recordings", f"{name}/*")),
        columns=None if columns is None else _read_columns(path, name, columns),
    )


def _read_columns(path: Path, name: str, given: Any) -> Columns:
    defaults = {f.name: f.default for f in fields(Columns)}
    for key, value in given.items() if isinstance(given, dict) else [("columns", given)]:
        default = defaults.get(key, KEYS)
        wanted: tuple[type, ...] = (str, int)
        if isinstance(default, bool):
            wanted = (bool,)
        elif key in ("skip", "rate_hz"):
            wanted = (int, float)
        if key not in defaults or not isinstance(value, wanted):
            raise FileError(
                f"{path}: expected columns of rig {name} as the options of sysid import "
                f"({', '.join(defaults)}), found {key}: {value!r}"
            )
    numbers = ("skip", "rate_hz")
    read: dict[str, Any] = {
        key: value if isinstance(value, bool) or key in numbers else str(value)
        for key, value in given.items()
    }
    columns = Columns(**read)
    if columns.segment is not None:
        raise FileError(
            f"{path}: expected files of a single run each for rig {name}, found segment: "
            f"{columns.segment}: part them with `sysid import --segment {columns.segment}`, and "
            "give the recordings that it writes, without columns"
        )
    try:
        check_columns(columns)
    except WrongUse as error:
        raise FileError(f"{path}: the columns of rig {name}: {error}") from error
    return columns
