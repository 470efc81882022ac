"""Write files whole or not at all, compute their digest, and read YAML and JSON files."""

from __future__ import annotations

import hashlib
import json
import os
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from pendulum_twin.errors import BadInputError
from pendulum_twin.strict_yaml import parse_yaml
from pendulum_twin.yaml_lines import find_line

YAML_MOST_BYTES = 1_000_000  # a twin file has about 1,000; longer ones take seconds to read
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


def describe_read_error(error: Exception) -> str:
    """Return why a file cannot be read, for a sentence of the one who reads it."""
    if isinstance(error, FileNotFoundError):
        return "no such file"
    if isinstance(error, IsADirectoryError):
        return "it is a folder"
    if isinstance(error, UnicodeDecodeError):
        return f"it is not UTF-8 (byte {error.start}): save it as UTF-8"
    if isinstance(error, json.JSONDecodeError | RecursionError):
        return "it is no JSON"
    reason = getattr(error, "strerror", None) or str(error)
    return " ".join(reason.split())


def read_yaml(path: str | Path, what: str, most_bytes: int = YAML_MOST_BYTES) -> Any:
    """Return what a YAML file holds, as `read_yaml_as` does."""
    return read_yaml_as(lambda content: content, path, what, most_bytes)


def read_yaml_as[T](
    parse: Callable[[Any], T], path: str | Path, what: str, most_bytes: int = YAML_MOST_BYTES
) -> T:
    """Return what a YAML file holds, read strictly (see `strict_yaml`).

    parse: takes the file's mappings, lists, texts and numbers; raises BadInputError for a wrong
        value.
    path: of the file.
    what: the kind of file, with its article, for the message: "a twin file".
    most_bytes: size of the largest file that is read.

    Raises BadInputError, with the path, and the line where it is known, when the file cannot be
    read, is too large, is empty, is no YAML or holds a wrong value.
    """
    try:
        with Path(path).open("rb") as stream:
            octets = stream.read(most_bytes + 1)
        if len(octets) > most_bytes:
            raise BadInputError(
                f"{path}: expected {what} of at most {most_bytes / 1e6:g} MB, found a larger file"
            )
        text = octets.decode("utf-8-sig")
    except (OSError, ValueError) as error:
        raise BadInputError(
            f"{path}: expected {what}, but it cannot be read: {describe_read_error(error)}"
        ) from error
    try:
        content = parse_yaml(text)
    except BadInputError as error:
        raise BadInputError(f"{path}: {error}") from error
    if content is None:
        raise BadInputError(f"{path}: expected {what}, found it empty")
    try:
        return parse(content)
    except BadInputError as error:
        line = find_line(text, str(error))
        where = path if line is None else f"{path}: line {line}"
        raise BadInputError(f"{where}: {error}") from error


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
        raise BadInputError(
            f"{expected}, but it cannot be read: {describe_read_error(error)}"
        ) from error
    if not isinstance(content, dict) or content.get("schema") != schema:
        raise BadInputError(f"{expected}, found another file")
    return content
