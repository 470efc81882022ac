"""Write the files of a command whole or not at all, and check them before the work begins."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from pendulum_twin.errors import BadInputError
from pendulum_twin.files import write_atomically


def check_file(path: Path) -> None:
    """Raise BadInputError unless a file can be written at the path, before any long work."""
    with name_write_errors(path):
        if path.is_dir():
            raise BadInputError(
                f"{path}: expected the name of a file to write, found a folder: name a file in it"
            )
    check_folder(path.parent)


def check_folder(path: Path) -> None:
    """Raise BadInputError unless the folder takes files or can be made; make nothing."""
    with name_write_errors(path):
        there = next(p for p in (path, *path.absolute().parents) if p.exists())
    if not there.is_dir():
        raise BadInputError(
            f"{path}: expected a folder to write to, found {there}, which is a file: "
            "name another place"
        )
    if not os.access(there, os.W_OK | os.X_OK):
        raise BadInputError(
            f"{path}: expected a place to write to, found {there} closed to writing: "
            "name another place"
        )


@contextmanager
def name_write_errors(path: Path) -> Iterator[None]:
    """Turn an error of the file system into a BadInputError that names the place."""
    try:
        yield
    except OSError as error:  # no room, no rights, a name that is too long
        reason = error.strerror or type(error).__name__
        raise BadInputError(
            f"{path}: expected a place to write to, found that it is none ({reason}): "
            "name another place"
        ) from error


def write_text(path: Path, text: str) -> None:
    """Write text whole or not at all; raise BadInputError when it cannot be written."""
    with name_write_errors(path):
        write_atomically(path, text)


def write_bytes(path: Path, data: bytes) -> None:
    """Write bytes whole or not at all; raise BadInputError when they cannot be written."""
    with name_write_errors(path):
        write_atomically(path, data)


def format_json(value: Any) -> str:
    """Return value as JSON; null stands for NaN and infinity, which JSON does not have."""
    return json.dumps(_convert_to_json_types(value), indent=2, allow_nan=False, ensure_ascii=False)


def _convert_to_json_types(value: Any) -> Any:
    """Return value in JSON's own types: numpy's numbers and arrays become numbers and lists."""
    if isinstance(value, dict):
        return {str(key): _convert_to_json_types(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_convert_to_json_types(item) for item in value]
    if isinstance(value, np.generic | np.ndarray):
        return _convert_to_json_types(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
