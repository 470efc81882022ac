"""Small files that a recording keeps, such as the twin that the driver used."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path

from pendulum_twin.errors import BadInputError

LARGEST_BYTES = 256 * 1024


def read_kept_files(paths: Mapping[str, str]) -> dict[str, str]:
    """Return the texts to keep: for each name with a path, three entries.

    `NAME`: the file's text. `NAME_file`: its name. `NAME_digest`: "sha256:<hex>".
    Raises BadInputError when a file cannot be read, is no text, or is larger than 256 KiB.
    """
    kept: dict[str, str] = {}
    for name, path in paths.items():
        if path:
            data = _read(name, Path(path))
            kept[name] = data.decode()
            kept[f"{name}_file"] = Path(path).name
            kept[f"{name}_digest"] = f"sha256:{hashlib.sha256(data).hexdigest()}"
    return kept


def _read(name: str, path: Path) -> bytes:
    try:
        data = path.read_bytes()
        data.decode()
    except OSError as error:
        raise BadInputError(
            f"{name}: expected a file to keep, found {path} ({error.strerror}): check the path"
        ) from error
    except UnicodeDecodeError as error:
        raise BadInputError(
            f"{name}: expected a text to keep, found other bytes in {path}"
        ) from error
    if len(data) > LARGEST_BYTES:
        raise BadInputError(
            f"{name}: expected at most {LARGEST_BYTES} bytes to keep, found {len(data)} in {path}"
        )
    return data
