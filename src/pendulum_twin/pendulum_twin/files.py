"""Write files whole or not at all, compute their digest, and read JSON files by their schema."""

from __future__ import annotations

import hashlib
import json
import os
import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from pendulum_twin.errors import BadInputError

_BLOCK_BYTES = 1 << 20  # how much of a file is held in memory while its digest is computed


def write_atomically(path: str | Path, content: str | bytes) -> None:
    """Write a file so that a reader sees all of the content or what was there before.

    path: of the file; missing folders above it are made.
    content: text, written as UTF-8, or bytes.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    temporary = Path(name)
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(content.encode() if isinstance(content, str) else content)
        temporary.chmod(0o644)
        temporary.replace(path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def compute_digest(paths: Iterable[Path]) -> str:
    """Return "sha256:<hex>" over the bytes of all files, one after the other, sorted by name."""
    digest = hashlib.sha256()
    for path in sorted(paths, key=lambda p: p.name):
        with path.open("rb") as stream:
            while block := stream.read(_BLOCK_BYTES):
                digest.update(block)
    return f"sha256:{digest.hexdigest()}"


def read_json_object(path: Path, schema: str, what: str) -> dict[str, Any]:
    """Return the JSON object in a file that names its schema.

    path: of the file.
    schema: what its key `schema` has to say.
    what: the kind of file, with its article, for the message: "a verdict".

    Raises BadInputError when the file cannot be read or holds something else.
    """
    expected = f"{path}: expected {what} with schema {schema}"
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise BadInputError(f"{expected}, but it cannot be read: {error}") from error
    if not isinstance(content, dict) or content.get("schema") != schema:
        raise BadInputError(f"{expected}, found another file")
    return content
